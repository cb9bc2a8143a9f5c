// See core/one.h.
#pragma once

namespace filigree {

class Twin;
struct Twin {
    float b = 0, c = 0;
};

inline double measure(const Twin& a_twin_with_a_name_so_long_that_the_list_of_parameters_goes_over_two_lines,
                      int steps = 1) {
    return steps * a_twin_with_a_name_so_long_that_the_list_of_parameters_goes_over_two_lines.b;
}
inline double measure(const Twin& another) { return another.c; }

} // namespace filigree
