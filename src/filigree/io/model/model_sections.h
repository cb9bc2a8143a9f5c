// A model file's container: a header, a table of sections, and the sections, plain little-endian arrays, each on an
// eight-byte boundary with its own checksum. Reading goes through the table alone, so sections of later versions are
// passed over. docs/fil-format.md has every byte.
#pragma once

#include "filigree/io/model/decoded_sections.h"
#include "filigree/io/model/lossless_sections.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

static_assert(std::endian::native == std::endian::little, "model files are written as the processor keeps them");

inline constexpr char kModelMagic[8] = {'F', 'I', 'L', 'I', 'G', 'R', 'E', 'E'};
inline constexpr std::uint32_t kModelVersion = 2;

struct ModelHeader {
    char magic[8];
    std::uint32_t version, section_count;
    std::uint64_t file_size;
    std::uint64_t table_hash; ///< XXH3-64 of the table
};
static_assert(sizeof(ModelHeader) == 32);

struct FileSection {
    char name[8];            ///< padded with zeros
    std::uint32_t index;     ///< of a level, a chunk, a scalar, a picture or a pose; else 0
    std::uint32_t item_size; ///< bytes
    std::uint64_t offset;    ///< from the start of the file, a multiple of 8
    std::uint64_t count;     ///< items
    std::uint64_t hash;      ///< XXH3-64 of the section's bytes
};
static_assert(sizeof(FileSection) == 40);

/// The bytes that a file of so many may come to in memory. Codes can be as short as the truth is plain, so a small file
/// might ask for any memory; real ones, 2 to 100 times their bytes, stay far below.
inline double most_unpacked(std::uint64_t file_bytes) {
    constexpr double kAlwaysAllowed = 1 << 28, kTimesTheBytes = 1024;
    return std::max(kAlwaysAllowed, kTimesTheBytes * double(file_bytes));
}
/// The writer's side: the error of a file that readers would refuse.
inline std::optional<Error> too_plain_to_pack(double unpacked, std::span<const std::string_view> file) {
    std::uint64_t bytes = 0;
    for (const std::string_view piece : file) bytes += piece.size();
    if (unpacked <= most_unpacked(bytes)) return std::nullopt;
    return Error{ErrorCode::unsuitable,
                 "The model packs to so few bytes that readers would take the file for a damaged "
                 "one; write it as it is, or with fewer frames."};
}

inline std::string name_of(const FileSection& section) {
    return {section.name, strnlen(section.name, sizeof section.name)};
}

/// Lays out the sections. What is in the model is not copied: it has to outlive the writer.
class SectionWriter {
public:
    template <class T>
    void array(std::string_view name, const std::vector<T>& items, std::uint32_t index = 0) {
        if (!items.empty()) add(name, index, items.data(), sizeof(T), items.size());
    }
    template <class T>
    void items(std::string_view name, std::span<const T> items, std::uint32_t index) {
        if (!items.empty()) add(name, index, items.data(), sizeof(T), items.size());
    }
    /// Of numbers that nobody else keeps.
    template <class T>
    void array(std::string_view name, std::vector<T>&& items, std::uint32_t index = 0) {
        if (items.empty()) return;
        const auto kept = std::make_shared<const std::vector<T>>(std::move(items));
        kept_.push_back(kept);
        array(name, *kept, index);
    }
    template <class T>
    void value(std::string_view name, const T& item) {
        array(name, std::vector<T>{item});
    }
    void bytes(std::string_view name, std::string_view items, std::uint32_t index) {
        add(name, index, items.data(), 1, items.size());
    }
    void strings(std::string_view name, const std::vector<std::string>& items) {
        std::vector<char> bytes; // each ended by a zero byte, so a name that holds one ends there
        for (const std::string& item : items)
            bytes.insert(bytes.end(), item.c_str(), item.c_str() + std::strlen(item.c_str()) + 1);
        array(name, std::move(bytes));
    }

    /// What was added; before finish().
    const std::vector<FileSection>& sections() const { return sections_; }
    std::string_view section_bytes(std::size_t k) const { return pieces_[2 * k]; }

    /// The file, piece after piece. Call it once.
    std::vector<std::string_view> finish() {
        const std::size_t table_bytes = sections_.size() * sizeof(FileSection);
        for (FileSection& section : sections_) section.offset += sizeof(ModelHeader) + table_bytes;
        ModelHeader header{};
        std::memcpy(header.magic, kModelMagic, sizeof kModelMagic);
        header.version = kModelVersion;
        header.section_count = static_cast<std::uint32_t>(sections_.size());
        header.file_size = sizeof(ModelHeader) + table_bytes + content_bytes_;
        header.table_hash = XXH3_64bits(sections_.data(), table_bytes);
        front_.assign(reinterpret_cast<const char*>(&header), sizeof header);
        front_.append(reinterpret_cast<const char*>(sections_.data()), table_bytes);
        pieces_.insert(pieces_.begin(), front_);
        return pieces_;
    }

private:
    void add(std::string_view name, std::uint32_t index, const void* items, std::size_t item_size, std::size_t count) {
        static constexpr std::string_view kZeros("\0\0\0\0\0\0\0\0", 8);
        const std::string_view bytes(static_cast<const char*>(items), item_size * count);
        FileSection section{};
        std::memcpy(section.name, name.data(), std::min<std::size_t>(name.size(), sizeof section.name));
        section.index = index;
        section.item_size = static_cast<std::uint32_t>(item_size);
        section.offset = content_bytes_;
        section.count = count;
        section.hash = XXH3_64bits(bytes.data(), bytes.size());
        sections_.push_back(section);
        pieces_.push_back(bytes);
        pieces_.push_back(kZeros.substr(0, (8 - bytes.size() % 8) % 8));
        content_bytes_ += bytes.size() + pieces_.back().size();
    }

    std::vector<FileSection> sections_;
    std::vector<std::string_view> pieces_;
    std::vector<std::shared_ptr<const void>> kept_;
    std::string front_;
    std::size_t content_bytes_ = 0;
};

/// What is wrong with a file, thrown inside the reading of models only and turned into an Error at its door.
struct FileDamage {
    std::string what, remedy = "strip the mesh again";
    ErrorCode code = ErrorCode::bad_file;
};

inline Error error_of(const FileDamage& damage, const std::string& name) {
    return {damage.code, name + " " + damage.what + "; " + damage.remedy + "."};
}

class SectionReader {
public:
    /// The file has to outlive the reader.
    explicit SectionReader(const FileReader& file) : file_(file) {
        ModelHeader header;
        if (file.size() < sizeof header) throw FileDamage{"is cut off in its header"};
        read(0, std::span(&header, 1));
        if (header.version != kModelVersion)
            throw FileDamage{"is of version " + std::to_string(header.version) + " and this program reads version " +
                                 std::to_string(kModelVersion),
                             "use a newer program, or strip the mesh again"};
        if (header.file_size != file.size())
            throw FileDamage{"should have " + std::to_string(header.file_size) + " bytes and has " +
                             std::to_string(file.size()) + ": it was cut off or added to"};
        if (header.section_count > (file.size() - sizeof header) / sizeof(FileSection))
            throw FileDamage{"names more sections than fit into it"};
        std::vector<FileSection> table(header.section_count);
        read(sizeof header, std::span(table));
        const std::size_t table_bytes = table.size() * sizeof(FileSection);
        if (XXH3_64bits(table.data(), table_bytes) != header.table_hash)
            throw FileDamage{"has a damaged table of sections (checksum)"};
        // No two sections share bytes, so all of them together need no more memory than the file.
        std::size_t end = sizeof header + table_bytes;
        for (const FileSection& section : table) {
            const std::string name = name_of(section);
            if (section.offset < end || section.offset > file.size() || section.item_size == 0 ||
                section.count > (file.size() - section.offset) / section.item_size)
                throw FileDamage{"has a section " + name + " that overlaps another or reaches past its end"};
            end = section.offset + section.count * section.item_size;
            sections_.emplace(std::pair(name, section.index), section);
        }
        if (sections_.contains({"ll.tab", 0})) open_lossless();
        if (sections_.contains({"rt.par", 0})) decode();
    }
    SectionReader(const SectionReader&) = delete;
    SectionReader& operator=(const SectionReader&) = delete;

    /// Refuses a file whose parts would come to so many bytes; see most_unpacked.
    void require_room(double bytes) const {
        if (!(bytes <= most_unpacked(file_.size())))
            throw FileDamage{"has " + std::to_string(file_.size()) +
                                 " bytes, and would come to more than 1,024 times as "
                                 "many: that makes no sense",
                             "pack its source again"};
    }

    /// The items of a section; empty when there is none.
    template <class T>
    std::vector<T> array(std::string_view name, std::uint32_t index = 0) const {
        const FileSection* section = find<T>(name, index);
        if (!section) return {};
        if (lossless_) return items_of<T>(lossless_->bytes(std::string(name), *section));
        std::vector<T> items(section->count);
        if (const void* decoded = decoded_items(name, index)) {
            std::memcpy(static_cast<void*>(items.data()), decoded, items.size() * sizeof(T));
            return items;
        }
        read(section->offset, std::span(items));
        if (XXH3_64bits(items.data(), items.size() * sizeof(T)) != section->hash)
            throw FileDamage{"has a damaged section " + std::string(name) + " (checksum)"};
        return items;
    }
    /// How many items a section has.
    template <class T>
    std::size_t item_count(std::string_view name, std::uint32_t index = 0) const {
        const FileSection* section = find<T>(name, index);
        return section ? section->count : 0;
    }
    /// Where in the file a section ends; 0 when there is none.
    std::uint64_t end_of(const std::string& name, std::uint32_t index = 0) const {
        const auto found = sections_.find({name, index});
        if (found == sections_.end()) return 0;
        return found->second.offset + found->second.count * found->second.item_size;
    }
    /// The sections of that name one after the other, by index: what is kept in chunks.
    template <class T>
    std::vector<T> all(const std::string& name) const {
        std::vector<T> items = array<T>(name);
        const auto [sections, last] = count(name);
        if (sections > 0 && last != sections - 1) throw FileDamage{"lacks a section " + name};
        for (std::uint32_t k = 1; k < sections; ++k) {
            const std::vector<T> more = array<T>(name, k);
            items.insert(items.end(), more.begin(), more.end());
        }
        return items;
    }
    /// Some items of a section alone, without its checksum. ids: ascending.
    template <class T>
    std::vector<T> chosen(std::string_view name, std::span<const Index> ids, std::uint32_t index = 0) const {
        constexpr std::size_t kGap = 4096 / sizeof(T), kPiece = (std::size_t{1} << 20) / sizeof(T); // items
        const FileSection* section = find<T>(name, index);
        if (!section) return {};
        if (!ids.empty() && ids.back() >= section->count)
            throw FileDamage{"lacks items in section " + std::string(name)};
        std::vector<T> items(ids.size()), piece;
        if (lossless_ || decoded_items(name, index)) {
            const std::vector<T> all = array<T>(name, index);
            for (std::size_t k = 0; k < ids.size(); ++k) items[k] = all[ids[k]];
            return items;
        }
        for (std::size_t begin = 0, end = 0; begin < ids.size(); begin = end) {
            // what lies close together is read at once
            for (end = begin + 1;
                 end < ids.size() && ids[end] - ids[end - 1] <= kGap && ids[end] - ids[begin] < kPiece;)
                ++end;
            piece.resize(ids[end - 1] - ids[begin] + 1);
            read(section->offset + ids[begin] * sizeof(T), std::span(piece));
            for (std::size_t k = begin; k < end; ++k) items[k] = piece[ids[k] - ids[begin]];
        }
        return items;
    }
    template <class T>
    T value(std::string_view name) const {
        const std::vector<T> items = array<T>(name);
        if (items.size() != 1) throw FileDamage{"lacks its section " + std::string(name)};
        return items[0];
    }
    /// Entries of that name, whatever their index; and the largest index.
    std::pair<std::size_t, std::uint32_t> count(const std::string& name) const {
        const auto first = sections_.lower_bound({name, 0}), end = sections_.upper_bound({name, ~std::uint32_t{0}});
        return {static_cast<std::size_t>(std::distance(first, end)), first == end ? 0 : std::prev(end)->first.second};
    }
    std::vector<std::string> strings(std::string_view name) const {
        std::vector<std::string> items;
        std::string item;
        for (char c : array<char>(name)) {
            if (c != '\0') {
                item += c;
                continue;
            }
            items.push_back(std::move(item));
            item.clear();
        }
        return items;
    }

    /// Whether the file is packed with the profile `runtime`. Its sections are then those of the plain file beside the
    /// packed ones.
    bool is_decoded() const { return decoded_ != nullptr; }
    bool is_lossless() const { return lossless_ != nullptr; }
    /// Of a lossless file: what each plain section takes, coded.
    std::vector<std::pair<std::string, std::uint64_t>> coded_sizes() const {
        std::vector<std::pair<std::string, std::uint64_t>> sizes;
        if (lossless_)
            for (const auto& [key, k] : lossless_->number)
                if (const auto code = lossless_->codes.find(k); code != lossless_->codes.end())
                    sizes.emplace_back(key.first, code->second.count);
        return sizes;
    }

private:
    using Key = std::pair<std::string, std::uint32_t>; ///< name and index

    /// The sections of a lossless file as the plain file had them.
    struct Lossless {
        const SectionReader& reader;
        std::map<Key, std::uint32_t> number;        ///< of plain sections
        std::map<std::uint32_t, FileSection> codes; ///< by that number
        SectionGuide guide;
        std::recursive_mutex poses;
        std::map<std::string, std::pair<std::uint32_t, std::string>> latest_pose; ///< the next one follows from it

        explicit Lossless(const SectionReader& of)
            : reader(of), guide([this](std::string_view name, std::uint32_t index) {
                  const auto found = reader.sections_.find({std::string(name), index});
                  return found == reader.sections_.end() ? std::string() : bytes(found->first.first, found->second);
              }) {}

        std::string bytes(const std::string& name, const FileSection& section) {
            if (!name.starts_with("pose.")) return decoded(name, section);
            const std::lock_guard lock(poses);
            if (const auto at = latest_pose.find(name); at != latest_pose.end() && at->second.first == section.index)
                return at->second.second;
            std::string frame = decoded(name, section);
            latest_pose[name] = {section.index, frame};
            return frame;
        }
        std::string decoded(const std::string& name, const FileSection& section) {
            const auto code = codes.find(number.at({name, section.index}));
            if (code == codes.end()) throw FileDamage{"lacks the code of its section " + name, "pack it again"};
            std::string stream(code->second.count, '\0');
            reader.read(code->second.offset, std::span(stream));
            std::optional<std::string> bytes;
            if (XXH3_64bits(stream.data(), stream.size()) == code->second.hash)
                bytes = decode_section(section, stream, guide);
            if (!bytes || XXH3_64bits(bytes->data(), bytes->size()) != section.hash)
                throw FileDamage{"has a damaged section " + name + " (checksum)", "pack it again"};
            return std::move(*bytes);
        }
    };

    void open_lossless() {
        const std::vector<FileSection> plain = array<FileSection>("ll.tab");
        auto lossless = std::make_unique<Lossless>(*this);
        std::map<Key, FileSection> sections;
        double unpacked = 0;
        for (std::uint32_t k = 0; k < plain.size(); ++k) {
            const FileSection& section = plain[k];
            const std::string name = name_of(section);
            if (section.item_size == 0 || section.count > (std::uint64_t{1} << 48) / section.item_size)
                throw FileDamage{"has a section " + name + " that makes no sense", "pack it again"};
            unpacked += double(section.count) * section.item_size;
            const auto code = sections_.find({"ll.sec", k});
            if (code != sections_.end() && code->second.item_size == 1) lossless->codes.emplace(k, code->second);
            lossless->number.emplace(Key(name, section.index), k);
            sections.emplace(Key(name, section.index), section);
        }
        require_room(unpacked);
        sections_ = std::move(sections);
        lossless_ = std::move(lossless);
    }

    void decode() {
        const DecodedSections::Find find = [this](const std::string& name, std::uint32_t index,
                                                  std::uint32_t item_size) -> std::optional<std::string> {
            const auto found = sections_.find({name, index});
            if (found == sections_.end() || found->second.item_size != item_size) return std::nullopt;
            std::string bytes(found->second.count * item_size, '\0');
            read(found->second.offset, std::span(bytes));
            if (XXH3_64bits(bytes.data(), bytes.size()) != found->second.hash)
                throw FileDamage{"has a damaged section " + name + " (checksum)", "pack it again"};
            return bytes;
        };
        auto decoded = std::make_unique<DecodedSections>(find, file_.size());
        if (decoded->failure() == DecodedSections::Failure::no_memory) throw std::bad_alloc();
        if (decoded->failure() == DecodedSections::Failure::newer)
            throw FileDamage{"was packed by a later version of filigree", "use a newer program"};
        if (decoded->failure() == DecodedSections::Failure::damaged)
            throw FileDamage{"holds a packed model that is damaged", "pack it again"};
        for (const auto& [key, section] : decoded->all()) {
            FileSection plain{};
            plain.index = key.second;
            plain.item_size = section.item_size;
            plain.count = section.count;
            sections_.insert_or_assign(key, plain);
        }
        decoded_ = std::move(decoded);
    }
    /// Null where the file has the section itself.
    const void* decoded_items(std::string_view name, std::uint32_t index) const {
        if (!decoded_) return nullptr;
        const auto found = decoded_->all().find({std::string(name), index});
        return found == decoded_->all().end() ? nullptr : found->second.items;
    }

    template <class T>
    static std::vector<T> items_of(const std::string& bytes) {
        std::vector<T> items(bytes.size() / sizeof(T));
        std::memcpy(static_cast<void*>(items.data()), bytes.data(), items.size() * sizeof(T));
        return items;
    }
    template <class T>
    void read(std::uint64_t offset, std::span<T> items) const {
        const std::span bytes(reinterpret_cast<char*>(items.data()), items.size_bytes());
        if (Status filled = file_.read(offset, bytes); !filled) throw filled.error();
    }
    /// Null: there is no such section.
    template <class T>
    const FileSection* find(std::string_view name, std::uint32_t index) const {
        const auto found = sections_.find({std::string(name), index});
        if (found == sections_.end()) return nullptr;
        if (found->second.item_size != sizeof(T))
            throw FileDamage{"has items of a wrong size in section " + found->first.first};
        return &found->second;
    }

    const FileReader& file_;
    std::map<Key, FileSection> sections_;      ///< of equals the first
    std::unique_ptr<Lossless> lossless_;       ///< of a lossless file, whose plain sections these are
    std::unique_ptr<DecodedSections> decoded_; ///< of a file of the profile `runtime`
};

} // namespace filigree
