#include "filigree/pack.h"

#include "filigree/coding/face_code.h"
#include "filigree/coding/mesh_code.h"
#include "filigree/coding/mesh_levels.h"
#include "filigree/io/file.h"
#include "filigree/io/mesh_sections.h"
#include "filigree/io/model_code.h"

#include <algorithm>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>

namespace filigree {

class ModelStream::Arrival {
public:
    Arrival(std::string of, std::uint64_t most) : name(std::move(of)), most_bytes(most) {}

    std::string name, bytes; ///< of the file, from its beginning
    std::uint64_t most_bytes;
    PackedMesh outline; ///< box and steps, without streams
    std::vector<FileLevel> table;
    std::vector<std::uint64_t> ends; ///< of the file, when each entry of the table is whole
    std::optional<LevelReader> reader;
    std::size_t levels = 0;
    std::uint64_t needed = sizeof(ModelHeader); ///< bytes until the table can be read on: not looked at before

    void take(std::string_view more) {
        bytes += more;
        if (table.empty() && (bytes.size() < needed || !read_table())) return;
        while (levels < ends.size() && bytes.size() >= ends[levels]) read_level();
    }

private:
    /// False: it is not whole yet.
    bool read_table() {
        ModelHeader header;
        if (bytes.size() < sizeof header) return false;
        std::memcpy(&header, bytes.data(), sizeof header);
        if (!is_model_file(std::string_view(bytes))) throw FileDamage{"is no model file"};
        const std::uint64_t front = sizeof header + std::uint64_t{header.section_count} * sizeof(FileSection);
        if (header.file_size > most_bytes || front > header.file_size)
            throw FileDamage{"says it has " + std::to_string(header.file_size) + " bytes, which makes no sense"};
        if (bytes.size() < front) return needed = front, false;
        const FileReader file(bytes, header.file_size);
        const SectionReader in(file);
        if (in.count("cd.stm").first == 0)
            throw Error{ErrorCode::unsuitable, name + ": is no stream; pack its model with the profile stream."};
        const std::uint64_t stated = std::max({in.end_of("cd.rev"), in.end_of("cd.par"), in.end_of("cd.stm")});
        needed =
            std::max({stated, in.end_of("mesh.org"), in.end_of("mat.nam"), in.end_of("mat.emb"), in.end_of("mtllib")});
        if (bytes.size() < needed) return false;
        const FileCode code = read_file_code(in);
        outline = coded_outline(in, code);
        outline.rest.materials.names = in.strings("mat.nam");
        outline.rest.embedded_materials = read_embedded_materials(in, outline.rest.materials.names, false);
        outline.rest.material_files = in.strings("mtllib");
        const LevelCodeOptions options = level_options(outline.options);
        reader.emplace(options.steps, options.is_refined, most_triangles(code.corners));
        table = in.array<FileLevel>("cd.stm");
        for (const PackedLevelMark& mark : coding_of(in, code).levels) ends.push_back(mark.bytes);
        for (std::size_t k = 1; k < ends.size(); ++k)
            if (ends[k] < ends[k - 1]) throw FileDamage{"has its levels in a wrong order"};
        return true;
    }

    void read_level() {
        const FileReader file(bytes, file_size());
        const SectionReader in(file);
        const auto k = std::uint32_t(levels);
        const auto stream = [&](std::string_view section, std::uint32_t index) {
            const std::vector<char> read = in.array<char>(section, index);
            return std::string(read.begin(), read.end());
        };
        bool is_sound = true;
        if (k == 0)
            is_sound = reader->read_coarsest(stream("cd.bcon", 0), stream("cd.bpos", 0), stream("cd.batt", 0));
        else if (table[k].batches > 0)
            is_sound = reader->read_level(stream("cd.lev", k), table[k].batches);
        else
            for (std::uint32_t level = 1; level < k && is_sound; ++level)
                is_sound = reader->refine_level(stream("cd.ref", level));
        if (!is_sound) throw FileDamage{"holds a level that is damaged", "pack it again"};
        ++levels;
    }

public:
    std::uint64_t file_size() const {
        ModelHeader header;
        std::memcpy(&header, bytes.data(), sizeof header);
        return header.file_size;
    }
};

ModelStream::ModelStream(std::string name, std::uint64_t most_bytes)
    : arrival_(std::make_unique<Arrival>(std::move(name), most_bytes)) {}
ModelStream::~ModelStream() = default;
ModelStream::ModelStream(ModelStream&&) noexcept = default;
ModelStream& ModelStream::operator=(ModelStream&&) noexcept = default;

Status ModelStream::feed(std::string_view bytes) {
    try {
        arrival_->take(bytes);
        return Success{};
    } catch (const FileDamage& damage) {
        return error_of(damage, arrival_->name);
    } catch (const Error& error) {
        return error;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, arrival_->name + ": does not fit into memory."};
    } catch (const std::length_error&) {
        return Error{ErrorCode::out_of_memory, arrival_->name + ": does not fit into memory."};
    }
}

std::size_t ModelStream::level_count() const { return arrival_->levels; }

double ModelStream::error() const {
    return arrival_->levels > 0 ? double(arrival_->table[arrival_->levels - 1].error)
                                : std::numeric_limits<double>::infinity();
}

Mesh ModelStream::mesh() const {
    return arrival_->levels > 0 ? mesh_of_levels(*arrival_->reader, arrival_->outline) : Mesh();
}

std::uint64_t ModelStream::next_level_end() const {
    const Arrival& a = *arrival_;
    return a.ends.empty() ? 0 : a.levels < a.ends.size() ? a.ends[a.levels] : a.file_size();
}

} // namespace filigree
