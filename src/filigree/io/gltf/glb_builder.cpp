#include "filigree/io/gltf/glb_builder.h"
#include "filigree/io/system/file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kHeader = 12, kChunkHeader = 8;

std::size_t padded(std::size_t bytes) { return (bytes + 3) / 4 * 4; }

std::string words(std::initializer_list<std::uint32_t> values) {
    return {reinterpret_cast<const char*>(values.begin()), 4 * values.size()};
}

constexpr std::uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

} // namespace

std::size_t GlbBuilder::add_part(Part part, GltfTarget target) {
    Json view = {{"buffer", 0}, {"byteOffset", data_bytes_}, {"byteLength", part.byte_count}};
    if (target != GltfTarget::none) view["target"] = static_cast<int>(target);
    data_bytes_ += padded(part.byte_count);
    parts_.push_back(std::move(part));
    json["bufferViews"].push_back(std::move(view));
    return parts_.size() - 1;
}

std::size_t GlbBuilder::add_accessor(const GltfAccessor& accessor, std::size_t view, std::size_t offset) {
    Json entry = {{"bufferView", view}};
    if (offset > 0) entry["byteOffset"] = offset;
    entry["componentType"] = static_cast<int>(accessor.component);
    entry["count"] = accessor.count;
    entry["type"] = accessor.type;
    if (accessor.normalized) entry["normalized"] = true;
    if (!accessor.min.empty()) entry["min"] = accessor.min, entry["max"] = accessor.max;
    json["accessors"].push_back(std::move(entry));
    return json["accessors"].size() - 1;
}

std::size_t GlbBuilder::add(const GltfAccessor& accessor, std::size_t byte_count, Producer producer) {
    const std::size_t view = add_part({byte_count, {}, std::move(producer)}, accessor.target);
    return add_accessor(accessor, view, 0);
}

std::size_t GlbBuilder::append(const GltfAccessor& accessor, std::string_view bytes) {
    Part& part = parts_.back();
    const std::size_t before = padded(part.byte_count);
    part.bytes.resize(before);
    part.bytes += bytes;
    part.byte_count = part.bytes.size();
    data_bytes_ += padded(part.byte_count) - before;
    json["bufferViews"].back()["byteLength"] = part.byte_count;
    return add_accessor(accessor, parts_.size() - 1, before);
}

std::size_t GlbBuilder::add(const GltfAccessor& accessor, std::string bytes) {
    const std::size_t number = add(accessor, bytes.size(), Producer{});
    parts_.back().bytes = std::move(bytes);
    return number;
}

std::size_t GlbBuilder::add_view(std::string bytes) {
    const std::size_t count = bytes.size();
    return add_part({count, std::move(bytes), {}}, GltfTarget::none);
}

std::size_t GlbBuilder::add_filtered_view(const char* filter, std::size_t stride, std::string bytes,
                                          std::string filtered) {
    const std::size_t view = add_view(std::move(bytes));
    filtered_.push_back({view, filter, stride, std::move(filtered)});
    return view;
}

std::size_t GlbBuilder::add_positions(std::span<const Vec3f> positions) {
    std::vector<Vec3f> rounded(positions.begin(), positions.end());
    Box box = bounds(rounded);
    if (position_bits_ > 0 && !box.empty() && box.size().maxCoeff() > 0) {
        const float step = std::ldexp(1.0f, std::ilogb(box.size().maxCoeff()) - position_bits_); // exact in floats
        for (Vec3f& p : rounded) p = (p / step).array().round() * step;
        box = bounds(rounded);
    }
    GltfAccessor accessor{.type = "VEC3", .target = GltfTarget::vertices, .count = rounded.size()};
    accessor.min.assign(box.min.data(), box.min.data() + 3);
    accessor.max.assign(box.max.data(), box.max.data() + 3);
    return add(accessor, bytes_of(std::span<const Vec3f>(rounded)));
}

std::size_t GlbBuilder::add_vectors(std::span<const Vec3f> vectors, GltfTarget target) {
    return add({.type = "VEC3", .target = target, .count = vectors.size()}, bytes_of(vectors));
}

std::size_t GlbBuilder::add_indices(std::span<const Index> indices) {
    constexpr Index kRestart16 = 65535; // the largest value of a type means "start anew"
    const GltfTarget target = GltfTarget::indices;
    if (std::any_of(indices.begin(), indices.end(), [](Index i) { return i >= kRestart16; }))
        return add({.component = GltfComponent::uint32, .target = target, .count = indices.size()}, bytes_of(indices));
    const std::vector<std::uint16_t> narrow(indices.begin(), indices.end());
    return add({.component = GltfComponent::uint16, .target = target, .count = indices.size()},
               bytes_of(std::span(narrow)));
}

std::size_t GlbBuilder::add_scalars(std::span<const float> values, GltfTarget target, bool with_bounds) {
    GltfAccessor accessor{.target = target, .count = values.size()};
    if (with_bounds && !values.empty()) {
        const auto [least, most] = std::minmax_element(values.begin(), values.end());
        accessor.min = {*least};
        accessor.max = {*most};
    }
    return add(accessor, bytes_of(values));
}

std::string GlbBuilder::json_chunk() const {
    Json document = {{"asset", {{"version", "2.0"}, {"generator", "Filigree"}}}};
    for (const auto& [key, value] : json.items()) {
        if (key == "asset")
            document["asset"].update(value);
        else
            document[key] = value;
    }
    if (data_bytes_ > 0 && !json.contains("buffers"))
        document["buffers"] = Json::array({{{"byteLength", data_bytes_}}});
    std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize(padded(text.size()), ' ');
    return text;
}

std::size_t GlbBuilder::byte_count() const {
    return kHeader + kChunkHeader + json_chunk().size() + (data_bytes_ > 0 ? kChunkHeader + data_bytes_ : 0);
}

Result<std::string> GlbBuilder::head() const {
    const std::string text = json_chunk();
    const std::size_t total = kHeader + kChunkHeader + text.size() + (data_bytes_ > 0 ? kChunkHeader + data_bytes_ : 0);
    if (total > std::numeric_limits<std::uint32_t>::max())
        return Error{ErrorCode::unsupported,
                     "The GLB would have " + std::to_string(total >> 20) +
                         " MiB, and the format ends at 4096; export fewer frames, a coarser level, or a skin."};
    const auto as32 = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
    std::string head = words({kGlbMagic, 2, as32(total), as32(text.size()), kJsonChunk}) + text;
    if (data_bytes_ > 0) head += words({as32(data_bytes_), kBinaryChunk});
    return head;
}

Status GlbBuilder::write_part(const Part& part, const Write& write) {
    std::size_t given = 0;
    const auto count_and_write = [&](std::string_view piece) {
        given += piece.size();
        return write(piece);
    };
    if (Status s = part.producer ? part.producer(count_and_write) : count_and_write(part.bytes); !s) return s;
    assert(given == part.byte_count);
    constexpr std::string_view kZeros("\0\0\0", 3);
    return write(kZeros.substr(0, padded(given) - given));
}

Status GlbBuilder::write_to(const Write& write) const {
    const Result<std::string> first = head();
    if (!first) return first.error();
    if (Status s = write(*first); !s) return s;
    if (!gathered_.empty()) return write(std::string_view(gathered_).substr(gathered_.size() - data_bytes_));
    for (const Part& part : parts_)
        if (Status s = write_part(part, write); !s) return s;
    return Success{};
}

Status GlbBuilder::write(const std::filesystem::path& path, const RunContext& context) {
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    Status written = write_to([&](std::string_view piece) -> Status {
        if (context.is_cancelled()) return cancelled_error();
        return file->write(piece);
    });
    if (!written) {
        Error error = written.error();
        if (error.code == ErrorCode::unsupported) error.message = path.string() + ": " + error.message;
        return error;
    }
    return file->finish();
}

Result<std::string> GlbBuilder::bytes() const {
    std::string all;
    Status written = write_to([&](std::string_view piece) -> Status {
        all += piece;
        return Success{};
    });
    if (!written) return written.error();
    return all;
}

Status GlbBuilder::compress() {
    if (gathered_.empty())
        if (const Result<std::string_view> all = gather(); !all) return all.error();
    Result<std::string> packed =
        compress_views(json, std::string_view(gathered_).substr(gathered_.size() - data_bytes_), filtered_);
    if (!packed) return packed.error();
    gathered_ = std::move(*packed);
    data_bytes_ = gathered_.size();
    return Success{};
}

Result<std::string_view> GlbBuilder::gather() {
    assert(gathered_.empty());
    Result<std::string> first = head();
    if (!first) return first.error();
    std::string all = *std::move(first);
    all.reserve(all.size() + data_bytes_);
    const auto append = [&](std::string_view piece) -> Status {
        all += piece;
        return Success{};
    };
    for (Part& part : parts_) {
        const Part taken = std::move(part); // its memory goes at the end of the round
        if (Status s = write_part(taken, append); !s) return s.error();
    }
    parts_.clear();
    gathered_ = std::move(all);
    return std::string_view(gathered_);
}

} // namespace filigree
