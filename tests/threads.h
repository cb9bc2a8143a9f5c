// Threads that tests run on.
#pragma once

#include "filigree/context.h"

#include <gtest/gtest.h>

inline const filigree::RunContext kOneThread(1), kTwoThreads(2), kAllThreads;

/// Leaves the test where there is one processor: contexts have no more threads than that, so it would compare one
/// thread with one thread.
#define FILIGREE_NEEDS_TWO_THREADS()                                                                                   \
    if (filigree::RunContext(2).threads() < 2) GTEST_SKIP() << "needs two processors"
