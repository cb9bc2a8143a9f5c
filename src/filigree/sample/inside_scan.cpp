// Three nested lower bounds and a prefix XOR. Per triangle: the layers k it spans (lower bounds of its vertices in z);
// in a layer, the rows j between two of its edges (lower bounds along y); in a row, the first point i at or beyond its
// plane (lower bound along x), where one bit is toggled. Then every row is prefix-XORed, 64 points at a time. Nothing
// is sorted, and `at or beyond` everywhere is all there is of tie-breaking.
#include "filigree/sample/inside_scan.h"
#include "filigree/sample/lattice_memory.h"

#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"
#include "filigree/sample/inside_scan_kernel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <string>

namespace filigree {

namespace {

using scan_kernel::Axis;
using scan_kernel::Job;
using scan_kernel::LargeTriangle;
using scan_kernel::Piece;

constexpr double kLowest = 0x1p-300; // what exact signs need of coordinates that are not 0
constexpr double kHighest = 0x1p300;
constexpr std::size_t kBatch = std::size_t{1} << 20; // triangles from one look at `cancel` and `progress` to the next
constexpr std::size_t kLargeBatch = std::size_t{1} << 14;
constexpr std::size_t kMergedBytes = std::size_t{32} << 20; // of signed crossings at a time, where a layer has fewer
constexpr std::size_t kCountable = 32'767; // triangles whose crossings, at most one a row each, fit 16 bits

std::size_t words_for(std::size_t points) { return (points + 63) / 64; }

/// An axis of the lattice for the kernel, or what is wrong with it.
Result<Axis> make_axis(const std::vector<double>& coordinates, double spacing, char name) {
    const std::string where = std::string("The lattice's coordinates along ") + name;
    if (coordinates.size() > kMostLowerBounds)
        return Error{ErrorCode::unsuitable, where + " are " + std::to_string(coordinates.size()) + "; the most are " +
                                                std::to_string(kMostLowerBounds) + ": take a larger spacing."};
    for (const double x : coordinates)
        if (!(std::abs(x) <= kHighest) || (x != 0 && std::abs(x) < kLowest))
            return Error{ErrorCode::usage, where + " hold a value that is not a number, or too large or small to be "
                                                   "decided exactly; make the lattice with make_lattice."};
    Axis axis;
    axis.count = coordinates.size();
    axis.values = coordinates;
    axis.values.resize(axis.count + Axis::kPadding, axis.count > 0 ? coordinates.back() : 0);
    if (axis.count == 0) return axis;
    axis.first = coordinates.front();
    if (axis.count == 1) {
        axis.computable = true;
        return axis;
    }
    const auto is_computable = [&](double step) {
        for (std::size_t i = 0; i < axis.count; ++i)
            if (axis.first + double(i) * step != coordinates[i]) return false;
        return true;
    };
    axis.step = spacing;
    axis.computable = is_computable(spacing);
    if (!axis.computable) axis.step = (coordinates.back() - axis.first) / double(axis.count - 1);
    axis.inverse_step = 1 / axis.step;
    bool even = axis.step >= kLowest;
    for (std::size_t i = 0; i < axis.count; ++i)
        even = even && std::abs(coordinates[i] - (axis.first + double(i) * axis.step)) < 0.125 * axis.step;
    for (std::size_t i = 1; i < axis.count; ++i) even = even && coordinates[i - 1] < coordinates[i];
    if (!even)
        return Error{ErrorCode::usage, where +
                                           " are not evenly spaced and ascending; make the lattice with make_lattice, "
                                           "or take a larger spacing where rounding did this."};
    return axis;
}

class Scan {
public:
    static Result<Scan> create(const ScanMesh& mesh, const Lattice& lattice, const RunContext& context, int lanes) {
        Scan scan(context, lanes);
        scan.counts_ = lattice.counts();
        for (int axis = 0; axis < 3; ++axis) {
            auto made = make_axis(lattice.coordinates[axis], lattice.spacing, "xyz"[axis]);
            if (!made) return made.error();
            scan.job_.axes[axis] = std::move(made).value();
        }
        scan.triangle_count_ = mesh.triangles.size();
        scan.is_empty_ = std::ranges::find(scan.counts_, 0u) != scan.counts_.end();
        if (scan.is_empty_) return scan;
        scan.codes_.resize(mesh.positions.size());
        scan.job_.positions = mesh.positions.data();
        scan.job_.triangles = mesh.triangles.data();
        scan.job_.codes = scan.codes_.data(); // moving a vector does not move what it holds
        scan.job_.shared = context.threads() > 1;
        parallel_for(context, mesh.positions.size(), std::size_t{1} << 15, [&](std::size_t begin, std::size_t end) {
            scan.loops_.encode(scan.job_, scan.codes_.data(), begin, end);
        });
        return scan;
    }

    const std::array<std::size_t, 3>& counts() const { return counts_; }

    /// Inside or not for all points. Returns false when cancelled.
    bool fill(Overlap overlap, std::uint64_t* bits) {
        if (is_empty_) return true;
        if (overlap == Overlap::merged) return fill_merged(bits);
        Job job = job_for(0, counts_[2]);
        job.bits = bits;
        job.row_entries = 64 * words_for(counts_[0]);
        if (!collect(job, 0, triangle_count_)) return false;
        fill_rows(bits);
        return true;
    }

    /// Winding numbers of some layers into `numbers`, which are 0.
    Status wind(std::size_t first_k, std::size_t layers, std::span<std::int16_t> numbers) {
        if (is_empty_) return Success{};
        std::vector<std::int32_t> wide;
        if (!collect_signed(first_k, layers, numbers, wide)) return cancelled_error();
        const bool fits = wide.empty() ? add_up_rows(numbers.data(), numbers) : add_up_rows(wide.data(), numbers);
        if (fits) return Success{};
        return Error{ErrorCode::unsuitable, "More than " + std::to_string(kCountable) +
                                                " surfaces of the mesh lie one within the other; take some away."};
    }

    void report_to(ScanReport* report) const {
        if (!report) return;
        report->crossings = total_.crossings;
        report->tally = total_.tally;
        report->seconds = now_seconds() - begin_;
    }

    static std::size_t merged_layers(const std::array<std::size_t, 3>& counts) {
        return std::max<std::size_t>(1, kMergedBytes / (sizeof(std::int16_t) * counts[0] * counts[1]));
    }

private:
    Scan(const RunContext& context, int lanes) : context_(context), loops_(scan_kernel::loops(lanes)) {}

    Job job_for(std::size_t first_k, std::size_t layers) const {
        Job job = job_;
        job.first_k = first_k;
        job.end_k = first_k + layers;
        return job;
    }

    std::size_t rows_at_once() const { return std::max<std::size_t>(1, (std::size_t{1} << 18) / counts_[0]); }

    /// Slab by slab, so that the signed crossings stay small.
    bool fill_merged(std::uint64_t* bits) {
        const std::size_t layer_points = counts_[0] * counts_[1], layer_words = words_for(counts_[0]) * counts_[1];
        const std::size_t slab = std::min(merged_layers(counts_), counts_[2]);
        std::vector<std::int16_t> crossings(layer_points * slab);
        std::vector<std::int32_t> wide;
        for (std::size_t k = 0; k < counts_[2]; k += slab) {
            const std::size_t layers = std::min(slab, counts_[2] - k);
            const std::span here = std::span(crossings).first(layer_points * layers);
            if (!collect_signed(k, layers, here, wide)) return false;
            if (wide.empty())
                fill_merged_rows(here.data(), layers, bits + k * layer_words);
            else
                fill_merged_rows(wide.data(), layers, bits + k * layer_words);
        }
        return true;
    }

    /// Signed crossings of some layers, added to `crossings`, which are 0. Where 16 bits are too few, `wide` gets them
    /// and `crossings` are 0; else `wide` is empty. Returns false when cancelled.
    bool collect_signed(std::size_t first_k, std::size_t layers, std::span<std::int16_t> crossings,
                        std::vector<std::int32_t>& wide) {
        std::atomic<bool> has_wrapped = false;
        Job job = job_for(first_k, layers);
        job.crossings = crossings.data();
        job.has_wrapped = &has_wrapped;
        job.row_entries = counts_[0];
        wide.clear();
        const scan_kernel::Piece before = total_;
        if (!collect(job, 0, triangle_count_)) return false;
        if (!has_wrapped) return true;
        total_ = before; // counted again
        std::ranges::fill(crossings, std::int16_t{0});
        wide.resize(crossings.size());
        for (std::size_t begin = 0; begin < triangle_count_; begin += kCountable) {
            if (!collect(job, begin, std::min(begin + kCountable, triangle_count_))) return false;
            parallel_for(context_, wide.size(), std::size_t{1} << 18, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i) {
                    wide[i] += crossings[i];
                    crossings[i] = 0;
                }
            });
        }
        return true;
    }

    /// Crossings at each point to those up to it. Returns whether all of them fit.
    template <class Crossing>
    bool add_up_rows(const Crossing* crossings, std::span<std::int16_t> numbers) const {
        const std::size_t n = counts_[0];
        std::atomic<bool> fits = true;
        parallel_for(context_, numbers.size() / n, rows_at_once(), [&](std::size_t begin, std::size_t end) {
            bool all_fit = true;
            for (std::size_t row = begin; row < end; ++row) {
                std::int32_t sum = 0;
                for (std::size_t i = row * n; i < (row + 1) * n; ++i) {
                    sum += crossings[i];
                    numbers[i] = std::int16_t(sum);
                    all_fit &= numbers[i] == sum;
                }
            }
            if (!all_fit) fits = false;
        });
        return fits;
    }

    /// All crossings of triangles begin .. end - 1 with the job's layers. Pieces may run in any order: toggling and
    /// adding commute.
    bool collect(const Job& job, std::size_t begin_triangle, std::size_t end_triangle) {
        // with one thread, large pieces fill vectors better; the result is the same
        const std::size_t grain = std::size_t{1} << (job.shared ? 13 : 16);
        std::vector<LargeTriangle> large;
        std::mutex mutex;
        const auto add_up = [&](const Piece& piece) {
            const std::lock_guard lock(mutex);
            total_.crossings += piece.crossings;
            total_.tally.integers += piece.tally.integers;
            total_.tally.expansions += piece.tally.expansions;
            large.insert(large.end(), piece.large.begin(), piece.large.end());
        };
        const auto in_batches = [&](std::size_t count, std::size_t batch, std::size_t piece_size, const auto& body) {
            for (std::size_t first = 0; first < count; first += batch) {
                if (context_.is_cancelled()) return false;
                parallel_for(context_, std::min(batch, count - first), piece_size,
                             [&](std::size_t begin, std::size_t end) {
                                 if (context_.is_cancelled()) return;
                                 Piece piece;
                                 body(first + begin, first + end, piece);
                                 add_up(piece);
                             });
                const double done = double(std::min(first + batch, count)) / double(count);
                const double layers = double(job.end_k - job.first_k);
                context_.report("scan", (double(job.first_k) + done * layers) / double(counts_[2]));
            }
            return !context_.is_cancelled();
        };
        const auto scan = [&](std::size_t begin, std::size_t end, Piece& piece) {
            loops_.scan_triangles(job, begin_triangle + begin, begin_triangle + end, piece);
        };
        if (!in_batches(end_triangle - begin_triangle, kBatch, grain, scan)) return false;
        const std::vector<LargeTriangle> tasks = std::move(large);
        large.clear();
        return in_batches(tasks.size(), kLargeBatch, 1, [&](std::size_t begin, std::size_t end, Piece& piece) {
            loops_.scan_large(job, std::span(tasks).subspan(begin, end - begin), piece);
        });
    }

    /// Toggles to inside and outside: each bit becomes the parity of those up to it.
    void fill_rows(std::uint64_t* bits) const {
        const std::size_t words = words_for(counts_[0]);
        const std::uint64_t last = ~std::uint64_t{0} >> (64 * words - counts_[0]);
        parallel_for(context_, counts_[1] * counts_[2], rows_at_once(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t row = begin; row < end; ++row) {
                std::uint64_t carry = 0;
                for (std::uint64_t& word : std::span(bits + row * words, words)) {
                    if (word == 0) { // nearly always
                        word = carry;
                        continue;
                    }
                    std::uint64_t x = word;
                    for (int shift = 1; shift < 64; shift *= 2) x ^= x << shift;
                    word = x ^= carry;
                    carry = -(x >> 63);
                }
                bits[row * words + words - 1] &= last;
            }
        });
    }

    /// Inside is where the sum of crossings is 1 or more. Leaves `crossings` zero, for the next slab. Stretches without
    /// a crossing, nearly all of them, are filled 64 points at a time; that halved the time for the dragon at 512^3.
    template <class Crossing>
    void fill_merged_rows(Crossing* crossings, std::size_t layers, std::uint64_t* bits) const {
        const std::size_t n = counts_[0], words = words_for(n);
        parallel_for(context_, counts_[1] * layers, rows_at_once(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t row = begin; row < end; ++row) {
                std::int32_t sum = 0;
                for (std::size_t w = 0; w < words; ++w) {
                    const std::span points(crossings + row * n + 64 * w, std::min<std::size_t>(64, n - 64 * w));
                    int any = 0;
                    for (const Crossing x : points) any |= x;
                    std::uint64_t word = sum >= 1 ? ~std::uint64_t{0} >> (64 - points.size()) : 0;
                    if (any != 0) {
                        word = 0;
                        for (std::size_t i = 0; i < points.size(); ++i) {
                            sum += points[i];
                            word |= std::uint64_t{sum >= 1} << i;
                        }
                        std::ranges::fill(points, Crossing{0});
                    }
                    bits[row * words + w] = word;
                }
            }
        });
    }

    const RunContext& context_;
    scan_kernel::Loops loops_;
    Job job_; ///< but for the slab and where results go
    std::array<std::size_t, 3> counts_ = {};
    std::vector<std::uint32_t> codes_;
    std::size_t triangle_count_ = 0;
    bool is_empty_ = false;
    Piece total_;
    double begin_ = now_seconds();
};

Result<Occupancy> scan_whole(const ScanMesh& mesh, const Lattice& lattice, const ScanOptions& options, int lanes,
                             const RunContext& context, ScanReport* report) {
    const std::array<std::size_t, 3> counts = lattice.counts();
    double bytes = double(mesh.positions.size()) * sizeof(std::uint32_t);
    if (options.overlap == Overlap::merged && lattice.point_count() > 0)
        bytes += double(counts[0]) * double(counts[1]) * sizeof(std::int16_t) *
                 double(std::min(counts[2], Scan::merged_layers(counts)));
    auto occupancy = make_occupancy(lattice, bytes, options.most_bytes);
    if (!occupancy) return occupancy;
    auto scan = Scan::create(mesh, lattice, context, lanes);
    if (!scan) return scan.error();
    if (!scan->fill(options.overlap, occupancy->bits.data())) return cancelled_error();
    scan->report_to(report);
    return occupancy;
}

} // namespace

std::span<const int> scan_lane_counts() { return scan_kernel::lane_counts(); }

Result<Occupancy> scan_inside(const ScanMesh& mesh, const Lattice& lattice, const ScanOptions& options,
                              const RunContext& context, ScanReport* report) {
    return scan_whole(mesh, lattice, options, scan_lane_counts().back(), context, report);
}

Result<Occupancy> scan_inside_with_lanes(const ScanMesh& mesh, const Lattice& lattice, int lanes,
                                         const RunContext& context) {
    return scan_whole(mesh, lattice, {}, lanes, context, nullptr);
}

Result<std::vector<std::int16_t>> scan_winding(const ScanMesh& mesh, const Lattice& lattice, std::size_t first_k,
                                               std::size_t layers, const RunContext& context, ScanReport* report,
                                               std::size_t most_bytes) {
    Lattice some = lattice; // the layers alone
    some.coordinates[2].resize(
        std::min(layers, lattice.coordinates[2].size() - std::min(first_k, lattice.counts()[2])));
    const double bytes = some.point_count() * sizeof(std::int16_t);
    if (Status fits = check_lattice_bytes(some, bytes, most_bytes); !fits) return fits.error();
    auto scan = Scan::create(mesh, lattice, context, scan_lane_counts().back());
    if (!scan) return scan.error();
    const std::array<std::size_t, 3>& counts = scan->counts();
    first_k = std::min(first_k, counts[2]);
    layers = std::min(layers, counts[2] - first_k);
    std::vector<std::int16_t> numbers(counts[0] * counts[1] * layers);
    if (Status wound = scan->wind(first_k, layers, numbers); !wound) return wound.error();
    scan->report_to(report);
    return numbers;
}

} // namespace filigree
