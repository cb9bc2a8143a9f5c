#include "filigree/mesh/box_tree.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

constexpr int kBins = 16;            // that a split is chosen from, an axis
constexpr std::size_t kFewItems = 8; // are split in the middle
constexpr std::size_t kSubtree = 4096;
constexpr int kSafeLevels = 48;

using Four = LaneTypes<4>::Float;
constexpr float kFar = std::numeric_limits<float>::infinity();

Four smaller(Four a, Four b) { return a < b ? a : b; }
Four larger(Four a, Four b) { return a > b ? a : b; }

/// Lanes x, y, z, and one that is not used.
struct WideBox {
    Four low = Four{} + kFar, high = Four{} - kFar; ///< of nothing
    void extend(const WideBox& by) {
        low = smaller(low, by.low);
        high = larger(high, by.high);
    }
    float half_surface() const {
        const Four size = high - low;
        return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
    }
};

} // namespace

struct BoxTree::Builder {
    struct Item {
        WideBox box;
        std::uint32_t number;
        Four doubled_centre() const { return box.low + box.high; }
    };
    /// items[begin] to items[end - 1].
    struct Range {
        std::uint32_t begin = 0, end = 0;
        WideBox box; ///< of the items
        std::uint32_t size() const { return end - begin; }
    };
    /// A subtree that is made later, and the child of a node that waits for it.
    struct Task {
        Range range;
        std::uint32_t node;
        int child, level;
    };

    std::vector<Item> items; ///< splits move them, so that what is near lies together

    Range range(std::uint32_t begin, std::uint32_t end) const {
        Range whole{begin, end, {}};
        for (std::uint32_t i = begin; i < end; ++i) whole.box.extend(items[i].box);
        return whole;
    }

    /// Both parts have items.
    std::array<Range, 2> split(const Range& whole, int level) {
        WideBox centres;
        for (std::uint32_t i = whole.begin; i < whole.end; ++i) {
            const Four centre = items[i].doubled_centre();
            centres.extend({centre, centre});
        }
        const Four width = centres.high - centres.low;
        int axis = width[1] > width[0] ? 1 : 0;
        if (width[2] > width[axis]) axis = 2;
        if (!(width[axis] > 0)) return at(whole, whole.begin + whole.size() / 2); // one place
        if (whole.size() <= kFewItems || level > kSafeLevels) return halves(whole, axis);
        return best_of_bins(whole, centres, axis);
    }

    std::array<Range, 2> at(const Range& whole, std::uint32_t middle) const {
        return {range(whole.begin, middle), range(middle, whole.end)};
    }

    std::array<Range, 2> halves(const Range& whole, int axis) {
        const std::uint32_t middle = whole.begin + whole.size() / 2;
        std::nth_element(items.begin() + whole.begin, items.begin() + middle, items.begin() + whole.end,
                         [&](const Item& s, const Item& t) {
                             const float a = s.doubled_centre()[axis], b = t.doubled_centre()[axis];
                             return a < b || (a == b && s.number < t.number);
                         });
        return at(whole, middle);
    }

    std::array<Range, 2> best_of_bins(const Range& whole, const WideBox& centres, int longest_axis) {
        struct Bin {
            WideBox box;
            std::uint32_t count = 0;
        };
        const Four width = centres.high - centres.low, scale = width > 0 ? 0.999f * kBins / width : Four{};
        const auto bins_of = [&](const Item& item) { // of a centre without a number, none that could be left out
            const Four at = larger((item.doubled_centre() - centres.low) * scale, Four{});
            return __builtin_convertvector(smaller(at, Four{} + (kBins - 1)), LaneTypes<4>::Int);
        };
        std::array<std::array<Bin, kBins>, 3> bins;
        for (std::uint32_t i = whole.begin; i < whole.end; ++i) {
            const auto at = bins_of(items[i]);
            for (int axis = 0; axis < 3; ++axis) {
                Bin& bin = bins[std::size_t(axis)][std::size_t(at[axis])];
                bin.box.extend(items[i].box);
                ++bin.count;
            }
        }
        float least = std::numeric_limits<float>::infinity();
        int best_axis = longest_axis, best = kBins / 2;
        for (int axis = 0; axis < 3; ++axis) {
            const std::array<Bin, kBins>& row = bins[std::size_t(axis)];
            std::array<float, kBins> above; // cost of bins from this one on
            WideBox box;
            std::uint32_t count = 0;
            for (std::size_t b = kBins; b-- > 1;) {
                box.extend(row[b].box);
                count += row[b].count;
                above[b] = count > 0 ? float(count) * box.half_surface() : 0;
            }
            box = {};
            count = 0;
            for (std::size_t b = 1; b < kBins; ++b) {
                box.extend(row[b - 1].box);
                count += row[b - 1].count;
                if (count == 0 || count == whole.size()) continue;
                if (const float cost = float(count) * box.half_surface() + above[b]; cost < least) {
                    least = cost;
                    best_axis = axis;
                    best = int(b);
                }
            }
        }
        const auto middle = std::partition(items.begin() + whole.begin, items.begin() + whole.end,
                                           [&](const Item& item) { return bins_of(item)[best_axis] < best; });
        const auto cut = static_cast<std::uint32_t>(middle - items.begin());
        if (cut == whole.begin || cut == whole.end) return halves(whole, longest_axis); // coordinates without a number
        std::array<Range, 2> both{{{whole.begin, cut, {}}, {cut, whole.end, {}}}};
        for (int b = 0; b < kBins; ++b)
            both[b < best ? 0 : 1].box.extend(bins[std::size_t(best_axis)][std::size_t(b)].box);
        return both;
    }

    /// Parts of a range, up to kWidth, which are the children of a node; how many.
    int parts(const Range& whole, int level, std::array<Range, kWidth>& found) {
        found[0] = whole;
        for (int count = 1; count < kWidth; ++count) {
            int largest = -1;
            for (int i = 0; i < count; ++i)
                if (found[i].size() > 1 &&
                    (largest < 0 || found[i].box.half_surface() > found[largest].box.half_surface()))
                    largest = i;
            if (largest < 0) return count;
            const std::array<Range, 2> both = split(found[largest], level);
            found[largest] = both[0];
            found[count] = both[1];
        }
        return kWidth;
    }

    /// Adds the node of a range and all below it, but for what is left to `later`; its number.
    std::uint32_t add(std::vector<Node>& nodes, const Range& whole, int level, std::vector<Task>* later) {
        const auto number = static_cast<std::uint32_t>(nodes.size());
        nodes.emplace_back();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            nodes[number].low[axis] = Lanes{} + kFar;
            nodes[number].high[axis] = Lanes{} - kFar;
        }
        nodes[number].child = {};
        std::array<Range, kWidth> children;
        const int count = parts(whole, level, children);
        for (int k = 0; k < count; ++k) {
            const Range& child = children[k];
            for (int axis = 0; axis < 3; ++axis) {
                nodes[number].low[std::size_t(axis)][k] = child.box.low[axis];
                nodes[number].high[std::size_t(axis)][k] = child.box.high[axis];
            }
            std::uint32_t at = 0;
            if (child.size() == 1)
                at = items[child.begin].number | kItem;
            else if (later && child.size() <= kSubtree)
                later->push_back({child, number, k, level + 1});
            else
                at = add(nodes, child, level + 1, later);
            nodes[number].child[std::size_t(k)] = at;
        }
        return number;
    }
};

BoxTree::BoxTree(std::span<const FloatBox> boxes, const RunContext& context) {
    if (boxes.empty()) return;
    Builder builder;
    builder.items.reserve(boxes.size());
    for (const auto& [low, high] : boxes)
        builder.items.push_back({{Four{low.x(), low.y(), low.z(), 0}, Four{high.x(), high.y(), high.z(), 0}},
                                 static_cast<std::uint32_t>(builder.items.size())});
    nodes_.reserve(boxes.size() / 2 + 1);
    std::vector<Builder::Task> tasks;
    builder.add(nodes_, builder.range(0, static_cast<std::uint32_t>(boxes.size())), 0, &tasks);
    std::vector<std::vector<Node>> subtrees(tasks.size());
    parallel_for(context, tasks.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) builder.add(subtrees[i], tasks[i].range, tasks[i].level, nullptr);
    });
    for (std::size_t i = 0; i < tasks.size(); ++i) {
        const auto offset = static_cast<std::uint32_t>(nodes_.size());
        nodes_[tasks[i].node].child[std::size_t(tasks[i].child)] = offset;
        for (Node& node : subtrees[i]) {
            for (std::uint32_t& child : node.child)
                if ((child & kItem) == 0) child += offset;
            nodes_.push_back(node);
        }
        subtrees[i] = {};
    }
}

} // namespace filigree
