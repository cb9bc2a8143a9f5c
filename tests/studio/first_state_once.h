// What a workbench starts with, made once for all tests of a process: half a second each otherwise.
#pragma once

#include "workbench.h"

namespace filigree::studio {

inline const State& first_state_once() {
    static const State state = first_state();
    return state;
}

} // namespace filigree::studio
