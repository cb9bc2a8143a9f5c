#include "filigree/io/gltf/gltf_document.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/text_scanner.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace filigree::gltf {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF's numbers are copied as they are");

constexpr std::size_t kDeepestJson = 256; // brackets; real files have about ten

std::string number_text(std::size_t n) { return std::to_string(n); }

template <class T>
T load(const char* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

/// nlohmann-json reads any depth, but copies and prints by recursion.
bool is_too_deep(std::string_view text) {
    std::size_t depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            if (c == '\\') ++i;
            in_string = c != '"';
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            if (++depth > kDeepestJson) return true;
        } else if ((c == ']' || c == '}') && depth > 0) {
            --depth;
        }
    }
    return false;
}

Json parse_json(std::string_view text) {
    if (is_too_deep(text)) throw Damage{"its JSON is nested deeper than " + number_text(kDeepestJson) + " brackets."};
    try {
        return Json::parse(text);
    } catch (const Json::parse_error& e) {
        throw Damage{"its JSON is damaged at byte " + number_text(e.byte) + "; the file may be cut off."};
    } catch (const Json::exception&) {
        throw Damage{"its JSON has a number that is too large."};
    }
}

std::string decode_base64(const Value& uri, std::string_view text) {
    static constexpr auto kDigits = [] {
        std::array<signed char, 256> digits{};
        digits.fill(-1);
        constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (std::size_t i = 0; i < kAlphabet.size(); ++i)
            digits[static_cast<unsigned char>(kAlphabet[i])] = static_cast<signed char>(i);
        return digits;
    }();
    while (!text.empty() && text.back() == '=') text.remove_suffix(1);
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 3);
    std::uint32_t bits = 0;
    int bit_count = 0;
    for (const char c : text) {
        const int digit = kDigits[static_cast<unsigned char>(c)];
        if (digit < 0) uri.fail("has a character that is not of base64.");
        bits = bits << 6 | static_cast<std::uint32_t>(digit);
        bit_count += 6;
        if (bit_count < 8) continue;
        bit_count -= 8;
        bytes += static_cast<char>(bits >> bit_count & 0xff);
    }
    return bytes;
}

std::string decode_percent(std::string_view uri) {
    const auto digit = [](char c) {
        return is_digit(c)              ? c - '0'
               : (c >= 'a' && c <= 'f') ? c - 'a' + 10
               : (c >= 'A' && c <= 'F') ? c - 'A' + 10
                                        : -1;
    };
    std::string name;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
            name += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
            i += 2;
        } else {
            name += uri[i];
        }
    }
    return name;
}

bool is_picture(std::string_view bytes) {
    return bytes.starts_with("\x89PNG\r\n\x1a\n") || bytes.starts_with("\xff\xd8\xff");
}

} // namespace

// ------------------------------------------------------------------------------------------------------------ values

void Value::fail(const std::string& why, ErrorCode code) const {
    throw Damage{path_.empty() ? why : path_ + ": " + why, code};
}

Value Value::operator[](const std::string& member) const {
    std::string path = path_.empty() ? member : path_ + "." + member;
    if (!json_) return {nullptr, std::move(path)};
    if (!json_->is_object()) fail("is not an object.");
    const auto found = json_->find(member);
    return {found == json_->end() ? nullptr : &*found, std::move(path)};
}

std::size_t Value::size() const {
    if (!json_) return 0;
    if (!json_->is_array()) fail("is not an array.");
    return json_->size();
}

Value Value::operator[](std::size_t element) const {
    assert(element < size());
    return {&(*json_)[element], path_ + "[" + number_text(element) + "]"};
}

std::vector<std::string> Value::members() const {
    if (!json_) return {};
    if (!json_->is_object()) fail("is not an object.");
    std::vector<std::string> names;
    for (const auto& [name, value] : json_->items()) names.push_back(name);
    return names;
}

double Value::number() const {
    if (!json_) fail("is missing.");
    if (!json_->is_number()) fail("is not a number.");
    return json_->get<double>();
}

std::size_t Value::whole() const {
    constexpr double kLargestExact = 9007199254740992; // 2^53
    if (json_ && json_->is_number_unsigned()) return json_->get<std::size_t>();
    const double x = number();
    if (!(x >= 0 && x <= kLargestExact && x == std::floor(x))) fail("is not a number of 0, 1, 2 and so on.");
    return static_cast<std::size_t>(x);
}

std::size_t Value::index(std::size_t count, const char* of) const {
    const std::size_t i = whole();
    if (i >= count)
        fail("refers to number " + number_text(i) + " of the " + of + ", of which there are " + number_text(count) +
             ".");
    return i;
}

bool Value::flag(bool otherwise) const {
    if (!json_) return otherwise;
    if (!json_->is_boolean()) fail("is neither true nor false.");
    return json_->get<bool>();
}

std::string Value::text() const {
    if (!json_) fail("is missing.");
    if (!json_->is_string()) fail("is not a string.");
    return json_->get<std::string>();
}

bool Value::numbers(double* out, std::size_t count) const {
    if (!json_) return false;
    if (size() != count)
        fail("has " + number_text(size()) + " numbers where there should be " + number_text(count) + ".");
    for (std::size_t i = 0; i < count; ++i) out[i] = (*this)[i].number();
    return true;
}

// --------------------------------------------------------------------------------------------------------- accessors

std::size_t size_of(Component component) {
    switch (component) {
    case Component::int8:
    case Component::uint8:
        return 1;
    case Component::int16:
    case Component::uint16:
        return 2;
    case Component::uint32:
    case Component::float32:
        break;
    }
    return 4;
}

std::size_t Accessor::sparse_index(std::size_t s) const {
    const char* const at = sparse_indices_ + s * size_of(sparse_component_);
    switch (sparse_component_) {
    case Component::uint8:
        return load<std::uint8_t>(at);
    case Component::uint16:
        return load<std::uint16_t>(at);
    default:
        return load<std::uint32_t>(at);
    }
}

std::size_t Accessor::first_sparse(std::size_t i) const {
    std::size_t begin = 0, end = sparse_count_;
    while (begin < end) {
        const std::size_t middle = (begin + end) / 2;
        if (sparse_index(middle) < i)
            begin = middle + 1;
        else
            end = middle;
    }
    return begin;
}

const char* Accessor::element(std::size_t i) const {
    if (sparse_count_ > 0) {
        const std::size_t s = first_sparse(i);
        if (s < sparse_count_ && sparse_index(s) == i) return sparse_values_ + s * width * size_of(component);
    }
    return base_ ? base_ + i * stride_ : nullptr;
}

template <class T>
void Accessor::read_as(const char* from, double* out, std::size_t numbers) const {
    for (std::size_t k = 0; k < numbers; ++k) {
        const auto value = static_cast<double>(load<T>(from + k * sizeof(T)));
        if constexpr (std::is_integral_v<T>)
            out[k] = normalized ? std::max(value / static_cast<double>(std::numeric_limits<T>::max()), -1.0) : value;
        else
            out[k] = value;
    }
}

void Accessor::read_from(const char* from, double* out, std::size_t numbers) const {
    if (!from) {
        std::fill(out, out + numbers, 0.0);
        return;
    }
    switch (component) {
    case Component::int8:
        return read_as<std::int8_t>(from, out, numbers);
    case Component::uint8:
        return read_as<std::uint8_t>(from, out, numbers);
    case Component::int16:
        return read_as<std::int16_t>(from, out, numbers);
    case Component::uint16:
        return read_as<std::uint16_t>(from, out, numbers);
    case Component::uint32:
        return read_as<std::uint32_t>(from, out, numbers);
    case Component::float32:
        return read_as<float>(from, out, numbers);
    }
}

void Accessor::read(std::size_t i, double* out) const { read_from(element(i), out, width); }

double Accessor::scalar(std::size_t i) const {
    double x = 0;
    read_from(element(i), &x, 1);
    return x;
}

std::uint32_t Accessor::integer(std::size_t i) const {
    const char* const from = element(i);
    if (!from) return 0;
    switch (component) {
    case Component::uint8:
        return load<std::uint8_t>(from);
    case Component::uint16:
        return load<std::uint16_t>(from);
    default:
        return load<std::uint32_t>(from);
    }
}

void Accessor::add_to(std::span<Vec3d> sums, std::size_t begin, std::size_t end, double weight) const {
    Vec3d value = Vec3d::Zero();
    if (base_)
        for (std::size_t i = begin; i < end; ++i) {
            read_from(base_ + i * stride_, value.data(), 3);
            sums[i - begin] += weight * value;
        }
    for (std::size_t s = first_sparse(begin); s < sparse_count_ && sparse_index(s) < end; ++s) {
        const std::size_t i = sparse_index(s);
        Vec3d base = Vec3d::Zero();
        read_from(base_ ? base_ + i * stride_ : nullptr, base.data(), 3);
        read_from(sparse_values_ + s * width * size_of(component), value.data(), 3);
        sums[i - begin] += weight * (value - base);
    }
}

void Accessor::read_all(float* out) const {
    if (base_ && component == Component::float32 && sparse_count_ == 0 && stride_ == width * sizeof(float)) {
        std::memcpy(out, base_, count * stride_);
        return;
    }
    std::array<double, 16> numbers;
    for (std::size_t i = 0; i < count; ++i) {
        read(i, numbers.data());
        for (std::size_t k = 0; k < width; ++k) *out++ = static_cast<float>(numbers[k]);
    }
}

// ---------------------------------------------------------------------------------------------------------- document

Document::Document(std::string_view bytes, std::filesystem::path folder, std::filesystem::path self)
    : file_(bytes), folder_(std::move(folder)), self_(std::move(self)), bytes_(bytes.size()) {
    json_ = parse_json(file_.starts_with("glTF") ? unpack_glb(file_) : file_);
    check_header();
}

/// The JSON chunk; remembers the binary one.
std::string_view Document::unpack_glb(std::string_view bytes) {
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
    if (bytes.size() < kHeader) throw Damage{"is cut off in its header."};
    const auto version = load<std::uint32_t>(bytes.data() + 4), length = load<std::uint32_t>(bytes.data() + 8);
    if (version != 2)
        throw Damage{"is GLB of version " + number_text(version) + ", and only 2 is read; export it anew.",
                     ErrorCode::unsupported};
    if (length > bytes.size())
        throw Damage{"should have " + number_text(length) + " bytes and has " + number_text(bytes.size()) +
                     "; it is cut off."};
    std::string_view rest = bytes.substr(kHeader, std::max<std::size_t>(length, kHeader) - kHeader), json;
    for (std::size_t chunk = 0; rest.size() >= kChunkHeader; ++chunk) {
        const auto size = load<std::uint32_t>(rest.data()), type = load<std::uint32_t>(rest.data() + 4);
        const std::string name = "chunk " + number_text(chunk);
        if (size > rest.size() - kChunkHeader)
            throw Damage{name + " says that it has " + number_text(size) + " bytes, and " +
                         number_text(rest.size() - kChunkHeader) + " are left; the file is damaged or cut off."};
        if ((chunk == 0) != (type == kJson)) throw Damage{name + (chunk == 0 ? " is not JSON." : " is JSON again.")};
        const std::string_view content = rest.substr(kChunkHeader, size);
        if (chunk == 0)
            json = content;
        else if (type == kBinary && !has_binary_chunk_)
            has_binary_chunk_ = true, binary_chunk_ = content;
        rest.remove_prefix(std::min(rest.size(), kChunkHeader + (size + std::size_t{3}) / 4 * 4));
    }
    if (json.empty()) throw Damage{"has no JSON chunk, or an empty one."};
    return json;
}

void Document::check_header() const {
    if (!json_.is_object()) throw Damage{"its JSON is not an object."};
    const Value asset = root()["asset"];
    if (!asset || !asset.json().is_object()) throw Damage{"has no \"asset\", so it is JSON but not glTF 2.0."};
    for (const char* member : {"version", "minVersion"}) {
        const Value version = asset[member];
        if (!version && std::string_view(member) == "minVersion") continue;
        const std::string text = version.text();
        if (text.substr(0, text.find('.')) != "2" || (std::string_view(member) == "minVersion" && text != "2.0"))
            version.fail("is " + in_quotes(text) + ", and glTF 2.0 is read; export it anew.", ErrorCode::unsupported);
    }
}

void Document::charge(std::size_t elements, const std::string& path) {
    // Real files touch each of their bytes about once; instances and shared attributes a few times more.
    constexpr std::size_t kAlwaysAllowed = std::size_t{1} << 24, kTimesTheBytes = 16;
    const std::size_t limit = std::max(kAlwaysAllowed, kTimesTheBytes * bytes_);
    if (elements > limit - charged_)
        throw Damage{path + ": repeats the file's parts to more than " + number_text(limit) +
                         " elements; export the scene without so many instances.",
                     ErrorCode::unsupported};
    charged_ += elements;
}

std::vector<std::string> Document::files_beside() const {
    std::vector<std::string> names;
    for (const char* array : {"buffers", "images"})
        for (std::size_t i = 0; i < count(array); ++i)
            if (const Value uri = item(array, i)["uri"]; uri && !uri.text().starts_with("data:"))
                names.push_back(uri.text());
    return names;
}

std::filesystem::path Document::beside(const Value& uri, const std::string& name) const {
    namespace fs = std::filesystem;
    constexpr std::size_t kLongestName = 4096;
    const std::string advice = "; only files in the folder of the glTF and below it are read.";
    if (name.empty()) uri.fail("is empty.");
    if (name.size() > kLongestName) uri.fail("is too long for the name of a file.");
    if (name.find('\0') != std::string::npos) uri.fail("has a zero byte.");
    if (name.find('\\') != std::string::npos) uri.fail("has a backslash; folders are separated by '/'.");
    if (name.front() == '/') uri.fail(in_quotes(name) + " is an absolute path" + advice);
    if (name.substr(0, name.find('/')).find(':') != std::string::npos)
        uri.fail(in_quotes(name) + " is not a relative path" + advice);
    for (const fs::path& part : path_of(name))
        if (part == "..") uri.fail(in_quotes(name) + " leads out of its folder" + advice);
    std::error_code failed;
    fs::path path = fs::canonical(folder_ / path_of(name), failed);
    if (failed) uri.fail("there is no file " + in_quotes(name) + " beside it.", ErrorCode::not_found);
    const fs::path folder = fs::canonical(folder_, failed);
    const auto [in_folder, in_path] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
    if (failed || in_folder != folder.end())
        uri.fail(in_quotes(name) + " is a link that leads out of its folder" + advice);
    if (!fs::is_regular_file(path, failed)) uri.fail(in_quotes(name) + " is not a file.");
    if (fs::equivalent(path, self_, failed)) uri.fail("is the glTF file itself.");
    return path;
}

std::string Document::resource(const Value& uri, std::size_t limit) const {
    const std::string text = uri.text();
    if (text.starts_with("data:")) {
        const std::size_t comma = text.find(',');
        const std::string_view header = std::string_view(text).substr(0, comma);
        if (comma == std::string::npos || !header.ends_with(";base64")) uri.fail("is data that is not in base64.");
        return decode_base64(uri, std::string_view(text).substr(comma + 1));
    }
    const std::string name = decode_percent(text);
    const std::filesystem::path path = beside(uri, name);
    const Result<FileReader> file = FileReader::open(path);
    if (!file) uri.fail("the file " + in_quotes(name) + " cannot be opened.", ErrorCode::not_found);
    std::string bytes(std::min<std::uint64_t>(file->size(), limit), '\0');
    if (!file->read(0, bytes)) uri.fail("the file " + in_quotes(name) + " cannot be read.", ErrorCode::not_found);
    return bytes;
}

std::string_view Document::buffer(std::size_t number) {
    const Value place = item("buffers", number);
    const std::size_t length = place["byteLength"].whole();
    const Value uri = place["uri"];
    std::string_view bytes;
    if (uri) {
        const auto [entry, is_new] = buffers_.try_emplace(number);
        if (is_new) {
            entry->second = resource(uri, length);
            bytes_ += entry->second.size();
        }
        bytes = entry->second;
    } else if (number == 0 && has_binary_chunk_) {
        bytes = binary_chunk_;
    } else if (place["extensions"]["EXT_meshopt_compression"]) {
        place.fail("is compressed (EXT_meshopt_compression), which is not read; unpack the file with 'gltf-transform "
                   "copy' or write it with gltfpack without -c.",
                   ErrorCode::unsupported);
    } else {
        place.fail("has no uri, and the file no binary chunk for it.");
    }
    if (length > bytes.size())
        place["byteLength"].fail("is " + number_text(length) + ", but there are " + number_text(bytes.size()) +
                                 " bytes; the data may be cut off.");
    return bytes.substr(0, length);
}

Document::View Document::view(const Value& reference) {
    const Value place = item("bufferViews", reference.index(count("bufferViews"), "bufferViews"));
    const std::string_view bytes = buffer(place["buffer"].index(count("buffers"), "buffers"));
    const std::size_t offset = place["byteOffset"].whole(0), length = place["byteLength"].whole();
    if (offset > bytes.size() || length > bytes.size() - offset)
        place.fail("reaches to byte " + number_text(offset) + " + " + number_text(length) + " of a buffer of " +
                   number_text(bytes.size()) + ".");
    return {bytes.substr(offset, length), place["byteStride"].whole(0)};
}

bool Document::serves(const Value& reference, const Wanted& wanted) const {
    const Value place = item("accessors", reference.index(count("accessors"), "accessors"));
    const std::string type = place["type"].text();
    const std::size_t component = place["componentType"].whole();
    return std::any_of(wanted.types.begin(), wanted.types.end(), [&](const char* t) { return type == t; }) &&
           std::any_of(wanted.components.begin(), wanted.components.end(),
                       [&](Component c) { return static_cast<std::size_t>(c) == component; });
}

Accessor Document::accessor(const Value& reference, const Wanted& wanted) {
    const Value place = item("accessors", reference.index(count("accessors"), "accessors"));
    Accessor accessor;
    accessor.path = place.path();

    const std::string type = place["type"].text();
    if (std::none_of(wanted.types.begin(), wanted.types.end(), [&](const char* t) { return type == t; }))
        place["type"].fail("is " + in_quotes(type) + ", which does not serve for " + reference.path() + ".");
    accessor.width = type == "SCALAR" ? 1 : type == "MAT4" ? 16 : static_cast<std::size_t>(type.back() - '0');

    const std::size_t component = place["componentType"].whole();
    const auto is_it = [&](Component c) { return static_cast<std::size_t>(c) == component; };
    if (std::none_of(wanted.components.begin(), wanted.components.end(), is_it))
        place["componentType"].fail("is " + number_text(component) + ", which does not serve for " + reference.path() +
                                    ".");
    accessor.component = static_cast<Component>(component);
    accessor.normalized = accessor.component != Component::float32 && place["normalized"].flag(false);

    accessor.count = place["count"].whole();
    const std::size_t element_size = accessor.width * size_of(accessor.component);
    const Value base = place["bufferView"], sparse = place["sparse"];
    if (accessor.count == 0) place["count"].fail("is 0.");
    if (base) {
        const View data = view(base);
        const std::size_t offset = place["byteOffset"].whole(0);
        accessor.stride_ = data.stride > 0 ? data.stride : element_size;
        if (accessor.stride_ < element_size)
            place.fail("has elements of " + number_text(element_size) + " bytes in a view with a stride of " +
                       number_text(accessor.stride_) + ".");
        if (offset > data.bytes.size() || element_size > data.bytes.size() - offset ||
            accessor.count - 1 > (data.bytes.size() - offset - element_size) / accessor.stride_)
            place["count"].fail("promises " + number_text(accessor.count) + " elements, more than its view of " +
                                number_text(data.bytes.size()) + " bytes holds from byte " + number_text(offset) + ".");
        accessor.base_ = data.bytes.data() + offset;
    } else if (accessor.count > bytes_) {
        // zeros need no bytes; but nothing real has more of them than it has bytes of other things
        place["count"].fail("promises " + number_text(accessor.count) + " elements, more than the file can mean.");
    }
    if (sparse) read_sparse(sparse, element_size, accessor);
    return accessor;
}

void Document::read_sparse(const Value& sparse, std::size_t element_size, Accessor& accessor) {
    const std::size_t count = sparse["count"].whole();
    const Value indices = sparse["indices"], values = sparse["values"];
    const std::size_t component = indices["componentType"].whole();
    if (component != 5121 && component != 5123 && component != 5125)
        indices["componentType"].fail("is " + number_text(component) + ", which does not serve for indices.");
    if (count > accessor.count)
        sparse["count"].fail("is " + number_text(count) + ", more than the accessor's " + number_text(accessor.count) +
                             " elements.");
    const auto part = [&](const Value& place, std::size_t bytes_each) {
        const View data = view(place["bufferView"]);
        const std::size_t offset = place["byteOffset"].whole(0);
        if (offset > data.bytes.size() || count > (data.bytes.size() - offset) / bytes_each)
            place.fail("has fewer than the " + number_text(count) + " elements that sparse.count promises.");
        return data.bytes.data() + offset;
    };
    accessor.sparse_component_ = static_cast<Component>(component);
    accessor.sparse_indices_ = part(indices, size_of(accessor.sparse_component_));
    accessor.sparse_values_ = part(values, element_size);
    accessor.sparse_count_ = count;
    charge(count, sparse.path());
    for (std::size_t s = 0; s < count; ++s) {
        const std::size_t i = accessor.sparse_index(s);
        if (i >= accessor.count)
            indices.fail("refer to element " + number_text(i) + " of " + number_text(accessor.count) + ".");
        if (s > 0 && i <= accessor.sparse_index(s - 1)) indices.fail("do not ascend.");
    }
}

std::string Document::picture(std::size_t image) {
    constexpr std::size_t kLargest = std::size_t{1} << 30;
    const Value place = item("images", image), uri = place["uri"], in_view = place["bufferView"];
    if (!uri && !in_view) place.fail("has neither a uri nor a bufferView.");
    std::string bytes = uri ? resource(uri, kLargest) : std::string(view(in_view).bytes);
    if (!is_picture(bytes)) place.fail("is neither PNG nor JPEG.");
    return bytes;
}

} // namespace filigree::gltf
