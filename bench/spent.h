// What a benchmark has spent so far.
#pragma once

#include <chrono>

#include <sys/resource.h>

struct Spent {
    double wall = 0, processor = 0; ///< s
};

inline rusage own_usage() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage;
}

inline Spent now() {
    const rusage usage = own_usage();
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    return {std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
            seconds(usage.ru_utime) + seconds(usage.ru_stime)};
}

/// The most memory that the process ever had.
inline double peak_bytes() { return 1024.0 * double(own_usage().ru_maxrss); }
