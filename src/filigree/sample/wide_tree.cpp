#include "filigree/sample/wide_tree.h"

#include <algorithm>
#include <utility>

namespace filigree {

namespace {

constexpr std::size_t kBins = 16;
constexpr int kDeepestByCost = 30; // below, by count: 32 levels more at most

struct Reference {
    FlatBox box;
    Index id;
    float middle(std::size_t axis) const { return box.lo[axis] + box.hi[axis]; }
};

class Builder {
public:
    Builder(std::vector<Reference> references, const RunContext& context)
        : references_(std::move(references)), context_(context) {}

    WideTree build() {
        add_node({box_of(0, references_.size()), 0, references_.size(), 0}, 0);
        tree_.order.reserve(references_.size());
        for (const Reference& r : references_) tree_.order.push_back(r.id);
        return std::move(tree_);
    }

private:
    using Child = WideTree::Child;

    std::vector<Reference> references_;
    const RunContext& context_;
    WideTree tree_;

    static std::size_t size(const Child& child) { return child.end - child.begin; }
    Child make_child(std::size_t begin, std::size_t end) const { return {box_of(begin, end), begin, end, 0}; }
    FlatBox box_of(std::size_t begin, std::size_t end) const {
        FlatBox box;
        for (std::size_t r = begin; r < end; ++r) box.extend(references_[r].box);
        return box;
    }

    std::uint32_t add_node(const Child& whole, int depth) {
        WideTree::Node node;
        node.children[0] = whole;
        node.count = 1;
        while (node.count < WideTree::kWidth) { // the largest that is not a leaf is divided
            Child* largest = nullptr;
            for (std::size_t c = 0; c < node.count; ++c)
                if (size(node.children[c]) > WideTree::kLeafSize &&
                    (!largest || node.children[c].box.half_area() > largest->box.half_area()))
                    largest = &node.children[c];
            if (!largest) break;
            const Child both = *largest;
            const std::size_t middle = divide(both, depth);
            *largest = make_child(both.begin, middle);
            node.children[node.count++] = make_child(middle, both.end);
        }
        const auto id = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes.push_back(node);
        for (std::size_t c = 0; c < node.count && !context_.is_cancelled(); ++c) {
            const bool is_leaf = size(node.children[c]) <= WideTree::kLeafSize;
            const std::uint32_t child = is_leaf ? WideTree::kLeaf | static_cast<std::uint32_t>(tree_.leaf_count++)
                                                : add_node(node.children[c], depth + 1);
            tree_.nodes[id].children[c].id = child;
        }
        return id;
    }

    /// Puts the range into two parts where box areas times leaves add up to least; returns where the second begins.
    std::size_t divide(const Child& range, int depth) {
        const auto first = references_.begin() + static_cast<std::ptrdiff_t>(range.begin);
        const auto last = references_.begin() + static_cast<std::ptrdiff_t>(range.end);
        FlatBox middles;
        for (auto r = first; r != last; ++r)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                middles.lo[axis] = std::min(middles.lo[axis], r->middle(axis));
                middles.hi[axis] = std::max(middles.hi[axis], r->middle(axis));
            }
        struct Bin {
            FlatBox box;
            std::size_t count = 0;
        };
        std::array<std::array<Bin, kBins>, 3> bins;
        std::array<float, 3> scale;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float extent = middles.hi[axis] - middles.lo[axis];
            scale[axis] = extent > 0 ? float(kBins) * 0.9999f / extent : 0;
            if (!(scale[axis] < 1e30f)) scale[axis] = 0;
        }
        const auto bin_of = [&](const Reference& r, std::size_t axis) {
            return static_cast<std::size_t>((r.middle(axis) - middles.lo[axis]) * scale[axis]);
        };
        for (auto r = first; r != last; ++r)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                Bin& bin = bins[axis][bin_of(*r, axis)];
                bin.box.extend(r->box);
                ++bin.count;
            }

        float least = INFINITY;
        std::size_t best_axis = 0, best_bin = 0;
        const auto cost = [](const Bin& part) {
            return part.box.half_area() *
                   static_cast<float>((part.count + WideTree::kLeafSize - 1) / WideTree::kLeafSize);
        };
        for (std::size_t axis = 0; axis < 3; ++axis) {
            std::array<float, kBins> upper_cost = {};
            Bin part;
            for (std::size_t b = kBins - 1; b > 0; --b) {
                part.box.extend(bins[axis][b].box);
                part.count += bins[axis][b].count;
                upper_cost[b] = part.count ? cost(part) : INFINITY;
            }
            part = {};
            for (std::size_t b = 1; b < kBins; ++b) {
                part.box.extend(bins[axis][b - 1].box);
                part.count += bins[axis][b - 1].count;
                if (part.count && cost(part) + upper_cost[b] < least) {
                    least = cost(part) + upper_cost[b];
                    best_axis = axis;
                    best_bin = b;
                }
            }
        }
        if (depth >= kDeepestByCost || !(least < INFINITY)) return range.begin + size(range) / 2;
        const auto middle =
            std::partition(first, last, [&](const Reference& r) { return bin_of(r, best_axis) < best_bin; });
        return static_cast<std::size_t>(middle - references_.begin());
    }
};

} // namespace

Result<WideTree> make_wide_tree(std::span<const FlatBox> boxes, const RunContext& context) {
    std::vector<Reference> references(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) references[i] = {boxes[i], static_cast<Index>(i)};
    WideTree tree = Builder(std::move(references), context).build();
    if (context.is_cancelled()) return cancelled_error();
    return tree;
}

} // namespace filigree
