// Each particle sums up the forces of its own springs: lanes are particles side by side along x.
#include "filigree/physics/springs/spring_kernel.h"

#include "filigree/core/lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree::spring_kernel {

namespace {

constexpr float kLargest = 1e15f; // m: a spring that long is not fit for explicit steps

/// 1 / sqrt(x) for x > 0 to float precision: a first guess from the exponent and three Newton steps.
template <int N>
FILIGREE_INLINE typename LaneTypes<N>::Float inverse_sqrt(typename LaneTypes<N>::Float x) {
    using Float = typename LaneTypes<N>::Float;
    using Int = typename LaneTypes<N>::Int;
    Float y = (Float)(0x5f3759df - ((Int)x >> 1));
    for (int step = 0; step < 3; ++step) y = y * (1.5f - 0.5f * x * y * y);
    return y;
}

template <int N>
FILIGREE_INLINE void spring_forces(const ForceJob& job, std::size_t begin, std::size_t end) {
    using Float = typename LaneTypes<N>::Float;
    using Loose = typename LaneTypes<N>::Loose;
    const auto load = [](const float* p) -> Float { return *reinterpret_cast<const Loose*>(p); };
    const Float zero = {};
    for (std::size_t r = begin; r < end; ++r) {
        const Run& run = job.runs[r];
        float run_bound = 0;
        for (std::size_t t = 0; t < run.count; t += N) {
            const std::size_t i = run.first + t;
            const Float x = load(job.x + i), y = load(job.y + i), z = load(job.z + i);
            Float fx = zero, fy = zero, fz = zero;
            Float xx = zero, yy = zero, zz = zero, xy = zero, xz = zero, yz = zero; // sum of blocks
            Float largest = zero;
            for (std::size_t s = run.first_slot; s < run.first_slot + run.slot_count; ++s) {
                const Slot& slot = job.slots[s];
                const Step& step = job.steps[slot.step];
                const std::int64_t j = std::int64_t(i) + slot.offset;
                Float dx = load(job.x + j) - x, dy = load(job.y + j) - y, dz = load(job.z + j) - z;
                Float squared = dx * dx + dy * dy + dz * dz;
                const auto is_short = squared < step.least_squared;
                dx = is_short ? zero + step.least.x() : dx;
                dy = is_short ? zero + step.least.y() : dy;
                dz = is_short ? zero + step.least.z() : dz;
                squared = is_short ? zero + step.least_squared : squared;
                const Float k = load(job.stiffness + slot.stiffness + t);
                const Float inverse = inverse_sqrt<N>(squared);
                const Float across = 1 - step.rest * inverse; // 1 - L / l: of k, the stiffness across the spring
                const Float tension = k * across;
                fx += tension * dx;
                fy += tension * dy;
                fz += tension * dz;
                // k [n n^T + a (I - n n^T)] with a = max(0, 1 - L / l), as (k (1 - a) / l^2) d d^T + k a I
                const Float a = across > zero ? across : zero;
                const Float isotropic = k * a, along = (k - isotropic) * (inverse * inverse);
                const Float ax = along * dx, ay = along * dy, az = along * dz;
                xx += ax * dx + isotropic;
                yy += ay * dy + isotropic;
                zz += az * dz + isotropic;
                xy += ax * dy;
                xz += ax * dz;
                yz += ay * dz;
                // Zero stiffness may stand for a particle that is none; NaN stays
                const Float size = k > zero ? squared : zero;
                largest = size <= largest ? largest : size;
            }
            // Of eigenvalues with mean m and variance v the largest is at most m + sqrt(2 v).
            const Float mean = (xx + yy + zz) * (1 / 3.f);
            const Float dxx = xx - mean, dyy = yy - mean, dzz = zz - mean;
            const Float spread = dxx * dxx + dyy * dyy + dzz * dzz + 2 * (xy * xy + xz * xz + yz * yz);
            const Float twice_variance = spread * (2 / 3.f) + 1e-30f;
            const Float bound =
                2 * (mean + twice_variance * inverse_sqrt<N>(twice_variance)) * load(job.inverse_mass + i);
            const std::size_t lanes = std::min<std::size_t>(N, run.count - t);
            for (std::size_t l = 0; l < lanes; ++l) {
                job.fx[i + l] = fx[l];
                job.fy[i + l] = fy[l];
                job.fz[i + l] = fz[l];
                const bool fit = largest[l] < kLargest * kLargest;
                run_bound = std::max(run_bound, fit ? bound[l] : std::numeric_limits<float>::infinity());
            }
        }
        job.squared_frequency[r] = run_bound;
    }
}

template <class Float>
FILIGREE_INLINE Float determinant(const LaneVector<Float>& a, const LaneVector<Float>& b, const LaneVector<Float>& c) {
    return dot(cross(a, b), c);
}

template <int N>
FILIGREE_INLINE void cell_volumes(const VolumeJob& job, std::size_t begin, std::size_t end) {
    using Float = typename LaneTypes<N>::Float;
    using Loose = typename LaneTypes<N>::Loose;
    using Vector = LaneVector<Float>;
    const auto load = [](const float* p) -> Float { return *reinterpret_cast<const Loose*>(p); };
    for (std::size_t r = begin; r < end; ++r) {
        const Cells::Run& run = job.runs[r];
        VolumeJob::Found found = {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(), 0};
        for (std::size_t t = 0; t < run.count; t += N) {
            Vector p[8];
            for (std::size_t c = 0; c < 8; ++c) {
                const std::size_t i = run.rows[c >> 1] + t + (c & 1);
                p[c] = {load(job.x + i), load(job.y + i), load(job.z + i)};
            }
            const Vector x[4] = {p[1] - p[0], p[3] - p[2], p[5] - p[4], p[7] - p[6]}; // edges, by the other two bits
            const Vector y[4] = {p[2] - p[0], p[3] - p[1], p[6] - p[4], p[7] - p[5]};
            const Vector z[4] = {p[4] - p[0], p[5] - p[1], p[6] - p[2], p[7] - p[3]};
            Float least = determinant(x[0], y[0], z[0]);
            for (std::size_t c = 1; c < 8; ++c) {
                const Float J = determinant(x[c >> 1], y[(c & 1) | (c >> 1 & 2)], z[c & 3]);
                least = J >= least ? least : J;
            }
            least *= job.inverse_cube;
            const Vector mean_x = x[0] + x[1] + (x[2] + x[3]), mean_y = y[0] + y[1] + (y[2] + y[3]),
                         mean_z = z[0] + z[1] + (z[2] + z[3]);
            const Float centre = determinant(mean_x, mean_y, mean_z) * (job.inverse_cube * (1 / 64.f));
            const Float squared = mean_x.x * mean_x.x + mean_x.y * mean_x.y + mean_x.z * mean_x.z +
                                  mean_y.x * mean_y.x + mean_y.y * mean_y.y + mean_y.z * mean_y.z +
                                  mean_z.x * mean_z.x + mean_z.y * mean_z.y + mean_z.z * mean_z.z;
            const std::size_t lanes = std::min<std::size_t>(N, run.count - t);
            for (std::size_t l = 0; l < lanes; ++l) {
                job.least[run.first_cell + t + l] = least[l];
                found.least_corner = least[l] >= found.least_corner ? found.least_corner : least[l]; // NaN stays
                found.least = centre[l] >= found.least ? found.least : centre[l];
                found.most_squared = squared[l] <= found.most_squared ? found.most_squared : squared[l];
            }
        }
        job.found[r] = found;
    }
}

#define FILIGREE_KERNELS(NAME, N, TARGET)                                                                              \
    TARGET void spring_forces_##NAME(const ForceJob& job, std::size_t begin, std::size_t end) {                        \
        spring_forces<N>(job, begin, end);                                                                             \
    }                                                                                                                  \
    TARGET void cell_volumes_##NAME(const VolumeJob& job, std::size_t begin, std::size_t end) {                        \
        cell_volumes<N>(job, begin, end);                                                                              \
    }
FILIGREE_KERNELS(plain, 4, )
#if defined(__x86_64__)
FILIGREE_KERNELS(avx2, 8, __attribute__((target("avx2"))))
FILIGREE_KERNELS(avx512, 16, __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw"))))
#endif
#undef FILIGREE_KERNELS

} // namespace

Kernels widest_kernels() {
#if defined(__x86_64__)
    if (vector_width_count() == 3) return {spring_forces_avx512, cell_volumes_avx512};
    if (vector_width_count() == 2) return {spring_forces_avx2, cell_volumes_avx2};
#endif
    return {spring_forces_plain, cell_volumes_plain};
}

} // namespace filigree::spring_kernel
