// How long a code is. A choice of contexts, guesses or weights that is not the best one gives the same mesh in more
// bytes, so tests of what comes back do not see it.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>

/// was: bytes when this was recorded. A two-hundredth more is allowed; who finds a shorter code writes its size.
inline void expect_coded_size(std::size_t bytes, std::size_t was, const char* what) {
    EXPECT_LE(bytes, was + was / 200) << what;
    EXPECT_GE(bytes, was - was / 50) << what << ": shorter than recorded; write the new size";
}
