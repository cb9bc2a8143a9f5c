// PLY, the Stanford polygon file format: text, and binary of both byte orders.
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/mesh/ply_body.h"

#include <algorithm>
#include <array>
#include <span>

namespace filigree {

using namespace ply;

namespace {

constexpr double kFullByte = 255, kFullShort = 65535; // a full colour

template <class Numbers>
class BodyReader {
public:
    BodyReader(const MeshSource& source, const Header& header, Numbers numbers)
        : source_(source), header_(header), numbers_(numbers) {}

    Result<MeshFile> read() {
        const Element* vertices = header_.find("vertex");
        if (!vertices || !vertices->has("x") || !vertices->has("y") || !vertices->has("z"))
            return source_.error("has no element 'vertex' with x, y and z.");
        if (vertices->count >= kNoIndex) return source_.unsupported("has more vertices than 32-bit indices can count.");
        const Element* faces = header_.find("face");
        has_faces_ = faces && faces->count > 0;
        vertex_count_ = vertices->count;
        for (const Element& element : header_.elements)
            if (!read_element(element)) return *error_;
        if (const std::size_t rest = numbers_.bytes_after_space(); rest > 0)
            file_.warnings.push_back(std::to_string(rest) + " bytes after the last element were left out.");
        split_origin(world_, file_.mesh);
        return std::move(file_);
    }

private:
    bool fail(const Element& element, std::size_t row, const std::string& cause) {
        error_ = numbers_.error(element.name + " " + std::to_string(row), cause);
        return false;
    }

    bool read_element(const Element& element) {
        if (element.properties.empty()) return true; // its rows are nothing
        if (element.count > numbers_.bytes_left())   // a row has a byte at least
            return fail(element, 0,
                        "the header promises " + std::to_string(element.count) +
                            " of these, more than the file can hold; it is cut off");
        if (source_.context.is_cancelled()) return error_ = cancelled_error(), false;
        source_.context.report("Reading", source_.fraction(numbers_.offset()));
        if (element.name == "vertex") return read_vertices(element);
        if (element.name == "face") return read_faces(element);
        if (element.name == "tristrips" && !has_faces_) return read_strips(element); // else they are the faces again
        if (element.count > 0) file_.warnings.push_back("The element " + in_quotes(element.name) + " was left out.");
        return skip_rows(element);
    }

    bool report_progress(std::size_t row) {
        if (row % kRowsBetweenReports != 0) return true;
        source_.context.report("Reading", source_.fraction(numbers_.offset()));
        if (!source_.context.is_cancelled()) return true;
        error_ = cancelled_error();
        return false;
    }

    // ---- rows of any kind

    bool read_number(const Element& element, std::size_t row, Type type, double& x) {
        const std::string problem = numbers_.read(type, x);
        return problem.empty() || fail(element, row, problem);
    }

    bool read_list(const Element& element, std::size_t row, const Property& property, std::vector<double>& list) {
        double length = 0;
        if (!read_number(element, row, *property.list_count, length)) return false;
        if (!(length >= 0) || length != std::floor(length))
            return fail(element, row, "the length of the list " + in_quotes(property.name) + " is not a count");
        if (length > static_cast<double>(numbers_.bytes_left()))
            return fail(element, row,
                        "the list " + in_quotes(property.name) + " is longer than the file; it is damaged or cut off");
        list.resize(static_cast<std::size_t>(length));
        for (double& x : list)
            if (!read_number(element, row, property.type, x)) return false;
        return true;
    }

    bool skip_rows(const Element& element) {
        if constexpr (std::is_same_v<Numbers, BinaryNumbers>)
            if (!element.has_lists()) return skip_table(element);
        std::vector<double> list;
        double x = 0;
        for (std::size_t row = 0; row < element.count; ++row) {
            if (!report_progress(row)) return false;
            for (const Property& p : element.properties)
                if (p.list_count ? !read_list(element, row, p, list) : !read_number(element, row, p.type, x))
                    return false;
        }
        return true;
    }

    bool skip_table(const Element& element) {
        const std::size_t room = numbers_.bytes_left() / element.row_bytes();
        if (element.count > room) return fail(element, room, "the file ends here; it is cut off");
        numbers_.skip(element.count * element.row_bytes());
        return true;
    }

    // ---- vertices

    static bool is_position(const Property& p) { return p.name == "x" || p.name == "y" || p.name == "z"; }

    bool read_vertices(const Element& element) {
        for (const Property& p : element.properties) {
            if (!p.list_count) continue;
            if (is_position(p)) return fail(element, 0, "the property " + in_quotes(p.name) + " is a list");
            file_.warnings.push_back("The vertex list " + in_quotes(p.name) + " was left out.");
        }
        Table table;
        if (!read_table(element, table)) return false;
        if (!read_positions(element, table)) return false;
        read_attributes(element, table);
        return true;
    }

    /// Binary rows without lists are a table as they lie in the file; others become one of doubles.
    bool read_table(const Element& element, Table& table) {
        table.rows = element.count;
        if constexpr (std::is_same_v<Numbers, BinaryNumbers>) {
            if (!element.has_lists()) {
                table.data = numbers_.data();
                table.swap = numbers_.swap();
                for (const Property& p : element.properties) {
                    table.columns.push_back({table.row_bytes, p.type});
                    table.row_bytes += size_of(p.type);
                }
                return skip_table(element);
            }
        }
        for (std::size_t i = 0; i < element.properties.size(); ++i)
            table.columns.push_back({i * sizeof(double), Type::float64});
        table.row_bytes = element.properties.size() * sizeof(double);
        table.numbers.reserve(std::min(element.count * element.properties.size(), numbers_.bytes_left()));
        std::vector<double> list;
        for (std::size_t row = 0; row < element.count; ++row) {
            if (!report_progress(row)) return false;
            for (const Property& p : element.properties) {
                double x = 0;
                if (p.list_count ? !read_list(element, row, p, list) : !read_number(element, row, p.type, x))
                    return false;
                if (is_position(p) && !fits_float(x)) return fail_position(element, row);
                table.numbers.push_back(x);
            }
        }
        table.data = reinterpret_cast<const char*>(table.numbers.data());
        return true;
    }

    bool fail_position(const Element& element, std::size_t row) {
        return fail(element, row, "a coordinate is not a finite number that fits 32-bit float");
    }

    bool read_positions(const Element& element, const Table& table) {
        const std::size_t axes[3] = {element.find("x"), element.find("y"), element.find("z")};
        Mesh& mesh = file_.mesh;
        mesh.positions.resize(table.rows);
        const bool floats =
            std::all_of(axes, axes + 3, [&](std::size_t a) { return table.columns[a].type == Type::float32; });
        if (!floats) {
            std::vector<Vec3d> world(table.rows);
            for (int axis = 0; axis < 3; ++axis)
                table.for_each(axes[axis], [&](std::size_t row, auto x) { world[row][axis] = static_cast<double>(x); });
            for (std::size_t row = 0; row < world.size(); ++row)
                for (const double x : world[row])
                    if (!fits_float(x)) return fail_position(element, row);
            world_ = std::move(world);
            return true;
        }
        const std::size_t x_offset = table.columns[axes[0]].offset;
        const bool adjacent =
            table.columns[axes[1]].offset == x_offset + 4 && table.columns[axes[2]].offset == x_offset + 8;
        if (adjacent && !table.swap) {
            const char* p = table.data + x_offset;
            for (std::size_t row = 0; row < table.rows; ++row, p += table.row_bytes)
                std::memcpy(mesh.positions[row].data(), p, 12);
        } else {
            for (int axis = 0; axis < 3; ++axis)
                table.for_each(axes[axis],
                               [&](std::size_t row, auto x) { mesh.positions[row][axis] = static_cast<float>(x); });
        }
        for (std::size_t row = 0; row < table.rows; ++row)
            if (!mesh.positions[row].allFinite()) return fail_position(element, row);
        return true;
    }

    void read_attributes(const Element& element, const Table& table) {
        Mesh& mesh = file_.mesh;
        std::vector<bool> used(element.properties.size());
        for (std::size_t i = 0; i < used.size(); ++i)
            used[i] = is_position(element.properties[i]) || element.properties[i].list_count;
        /// The columns of these names, when all are there and none is used.
        const auto find_columns = [&](std::initializer_list<const char*> names) {
            std::vector<std::size_t> columns;
            for (const char* name : names)
                if (const std::size_t i = element.find(name); i < used.size() && !used[i]) columns.push_back(i);
            if (columns.size() != names.size()) columns.clear();
            for (const std::size_t i : columns) used[i] = true;
            return columns;
        };
        const auto copy_columns = [&](const std::vector<std::size_t>& columns, auto& values) {
            if (columns.empty() || !values.empty()) return;
            values.resize(table.rows);
            for (std::size_t i = 0; i < columns.size(); ++i)
                table.for_each(columns[i], [&](std::size_t row, auto x) {
                    values[row][static_cast<int>(i)] = static_cast<float>(x);
                });
        };
        copy_columns(find_columns({"nx", "ny", "nz"}), mesh.normals.values);
        for (const auto& names : {std::array{"s", "t"}, std::array{"u", "v"}, std::array{"texture_u", "texture_v"}})
            if (mesh.uvs.empty()) copy_columns(find_columns({names[0], names[1]}), mesh.uvs.values);
        for (const std::size_t i : read_colors(element, table, used)) used[i] = true;
        for (std::size_t i = 0; i < used.size(); ++i) {
            if (used[i]) continue;
            VertexScalar scalar{element.properties[i].name, std::vector<float>(table.rows)};
            table.for_each(i, [&](std::size_t row, auto x) { scalar.values[row] = static_cast<float>(x); });
            mesh.scalars.push_back(std::move(scalar));
        }
    }

    /// Returns the columns that are the colour. Without one, alpha is a scalar; and r, g and b that are no colours are.
    std::vector<std::size_t> read_colors(const Element& element, const Table& table, const std::vector<bool>& used) {
        std::vector<std::string> names;
        for (std::size_t i = 0; i < used.size(); ++i) names.push_back(used[i] ? "" : element.properties[i].name);
        const std::vector<std::size_t> columns = find_color(names);
        if (columns.empty()) return {};
        const std::span<const std::size_t> rgb = std::span(columns).first(3);
        const bool is_short = element.properties[columns[0]].name.size() == 1;
        if (is_short && !are_colors(element, table, rgb)) return {};
        Mesh& mesh = file_.mesh;
        mesh.colors.assign(table.rows, Vec4f::Ones());
        mesh.colors_have_alpha = columns.size() == 4;
        const double full = full_color(element, table, rgb);
        for (std::size_t i = 0; i < columns.size(); ++i) {
            const auto of_column =
                static_cast<float>(i < 3 ? full : full_color(element, table, std::span(columns).subspan(i)));
            table.for_each(columns[i], [&](std::size_t row, auto x) {
                mesh.colors[row][static_cast<int>(i)] = static_cast<float>(x) / of_column;
            });
        }
        return columns;
    }

    /// Whether columns r, g and b, which may be anything, are of one type and from 0 up.
    static bool are_colors(const Element& element, const Table& table, std::span<const std::size_t> columns) {
        bool sound = true;
        for (const std::size_t c : columns) {
            sound = sound && element.properties[c].type == element.properties[columns[0]].type;
            table.for_each(c, [&](std::size_t, auto x) { sound = sound && x >= 0; });
        }
        const double largest = largest_of(table, columns);
        return sound && (is_float(element.properties[columns[0]].type) ? largest <= kFullByte : true);
    }

    static bool is_float(Type type) { return type == Type::float32 || type == Type::float64; }

    static double largest_of(const Table& table, std::span<const std::size_t> columns) {
        double largest = 0;
        for (const std::size_t c : columns)
            table.for_each(c, [&](std::size_t, auto x) { // not NaN
                if (static_cast<double>(x) > largest) largest = static_cast<double>(x);
            });
        return largest;
    }

    /// What stands for a full colour in these columns: by the type where it is a byte, else by the largest number.
    double full_color(const Element& element, const Table& table, std::span<const std::size_t> columns) {
        const Type type = element.properties[columns[0]].type;
        const double largest = largest_of(table, columns);
        if (type == Type::uint8) return kFullByte;
        if (type == Type::uint16 && largest > kFullByte) return kFullShort;
        if (largest <= 1) return 1;
        const double full = largest <= kFullByte                      ? kFullByte
                            : type == Type::int16                     ? 32767
                            : largest <= kFullShort || is_float(type) ? kFullShort
                            : type == Type::int32                     ? 2147483647
                                                                      : 4294967295;
        file_.warnings.push_back("Colours go beyond 1 and were taken as 0 to " +
                                 std::to_string(static_cast<std::uint64_t>(full)) + ".");
        return full;
    }

    // ---- faces

    /// The property that lists a face's or strip's vertices; none, with a warning, where there is no such list.
    std::optional<std::size_t> find_indices(const Element& element, const char* what) {
        const std::size_t indices =
            element.has("vertex_indices") ? element.find("vertex_indices") : element.find("vertex_index");
        if (indices < element.properties.size() && element.properties[indices].list_count) return indices;
        if (element.count > 0)
            file_.warnings.push_back("The " + std::string(what) + " have no list 'vertex_indices' and were left out.");
        return {};
    }

    bool read_faces(const Element& element) {
        const std::optional<std::size_t> found = find_indices(element, "faces");
        if (!found) return skip_rows(element);
        const std::size_t indices = *found;
        for (const Property& p : element.properties)
            if (p.name != element.properties[indices].name && !is_texcoord(p))
                file_.warnings.push_back("The face property " + in_quotes(p.name) + " was left out.");
        if (has_vertex_uvs() && std::any_of(element.properties.begin(), element.properties.end(), is_texcoord))
            file_.warnings.emplace_back("The faces' 'texcoord' was left out: the vertices have UVs too.");
        short_faces_ = 0;
        if (!read_face_rows(element, indices)) return false;
        if (short_faces_ > 0)
            file_.warnings.push_back(std::to_string(short_faces_) +
                                     " faces with fewer than three corners were left out.");
        return true;
    }

    bool has_vertex_uvs() const { return file_.mesh.uvs.per_vertex() && !file_.mesh.uvs.empty(); }

    static bool is_texcoord(const Property& p) { return p.name == "texcoord" && p.list_count; }

    bool read_face_rows(const Element& element, std::size_t indices) {
        if constexpr (std::is_same_v<Numbers, BinaryNumbers>) {
            const Property& p = element.properties[indices];
            const bool common = element.properties.size() == 1 && p.list_count == Type::uint8 && size_of(p.type) == 4 &&
                                p.type != Type::float32;
            if (common) return read_common_faces(element);
        }
        Mesh& mesh = file_.mesh;
        mesh.face_offsets.reserve(element.count + 1);
        std::vector<double> corners, list, texcoords;
        double x = 0;
        for (std::size_t row = 0; row < element.count; ++row) {
            if (!report_progress(row)) return false;
            for (std::size_t i = 0; i < element.properties.size(); ++i) {
                const Property& p = element.properties[i];
                std::vector<double>& target = i == indices ? corners : is_texcoord(p) ? texcoords : list;
                if (p.list_count ? !read_list(element, row, p, target) : !read_number(element, row, p.type, x))
                    return false;
            }
            if (!add_face(element, row, corners)) return false;
            if (corners.size() >= 3) add_uvs(corners.size(), texcoords);
        }
        if (!mesh.uvs.corners.empty()) mesh.uvs.corners.resize(mesh.corner_count(), kNoIndex);
        return true;
    }

    bool fail_index(const Element& element, std::size_t row, double index) {
        if (index != std::floor(index)) return fail(element, row, "a vertex index is not a whole number");
        const auto found =
            std::abs(index) < 1e18 ? std::to_string(static_cast<std::int64_t>(index)) : std::string("a huge number");
        return fail(element, row,
                    "a corner refers to vertex " + found + ", but there are " + std::to_string(vertex_count_) +
                        " vertices, counted from 0");
    }

    bool is_vertex(double index) const { // NaN fails the first comparison
        return index >= 0 && index < static_cast<double>(vertex_count_) && index == std::floor(index);
    }

    bool add_face(const Element& element, std::size_t row, const std::vector<double>& corners) {
        Mesh& mesh = file_.mesh;
        for (const double index : corners)
            if (!is_vertex(index)) return fail_index(element, row, index);
        if (corners.size() < 3) return ++short_faces_, true;
        if (mesh.corners.size() + corners.size() >= kNoIndex) return fail_too_many();
        for (const double index : corners) mesh.corners.push_back(static_cast<Index>(index));
        mesh.face_offsets.push_back(static_cast<Index>(mesh.corners.size()));
        return true;
    }

    bool fail_too_many() {
        error_ = source_.unsupported("has more corners than 32-bit indices can count.");
        return false;
    }

    /// Stanford's early scans have strips of triangles in place of faces.
    bool read_strips(const Element& element) {
        const std::optional<std::size_t> indices = find_indices(element, "triangle strips");
        if (!indices) return skip_rows(element);
        std::vector<double> strip, list;
        double x = 0;
        for (std::size_t row = 0; row < element.count; ++row) {
            if (!report_progress(row)) return false;
            for (std::size_t i = 0; i < element.properties.size(); ++i) {
                const Property& p = element.properties[i];
                if (p.list_count ? !read_list(element, row, p, i == *indices ? strip : list)
                                 : !read_number(element, row, p.type, x))
                    return false;
            }
            if (!add_strips(element, row, strip)) return false;
        }
        return true;
    }

    /// Every vertex of a strip makes a triangle with the two before it; every second one is turned over, so that all
    /// have one orientation. -1 ends a strip and begins the next.
    bool add_strips(const Element& element, std::size_t row, const std::vector<double>& vertices) {
        constexpr double kEnd = -1, kUnsignedEnd = 4294967295; // the same bits as uint
        Mesh& mesh = file_.mesh;
        Index a = 0, b = 0;
        std::size_t length = 0;
        for (const double vertex : vertices) {
            if (vertex == kEnd || vertex == kUnsignedEnd) {
                length = 0;
                continue;
            }
            if (!is_vertex(vertex)) return fail_index(element, row, vertex);
            const auto c = static_cast<Index>(vertex);
            if (length >= 2 && a != b && b != c && c != a) { // strips are sewn together with repeated vertices
                if (mesh.corners.size() + 3 >= kNoIndex) return fail_too_many();
                mesh.add_face(length % 2 == 0 ? Triangle{a, b, c} : Triangle{a, c, b});
            }
            a = b, b = c;
            ++length;
        }
        return true;
    }

    /// MeshLab's UVs: a list of u, v for each corner of the face just added.
    void add_uvs(std::size_t corner_count, const std::vector<double>& texcoords) {
        CornerAttribute<Vec2f>& uvs = file_.mesh.uvs;
        if (texcoords.size() != 2 * corner_count || has_vertex_uvs()) return;
        uvs.corners.resize(file_.mesh.corner_count() - corner_count, kNoIndex);
        for (std::size_t c = 0; c < corner_count; ++c) {
            uvs.corners.push_back(static_cast<Index>(uvs.values.size()));
            uvs.values.emplace_back(static_cast<float>(texcoords[2 * c]), static_cast<float>(texcoords[2 * c + 1]));
        }
    }

    /// Nothing but lists of 4-byte indices with a 1-byte length, which is what nearly all binary files have: sizes in
    /// a first pass, then plain copies. Six times faster than number by number (3.5 against 0.5 GB/s on a scan).
    bool read_common_faces(const Element& element) {
        const char* const begin = numbers_.data();
        const std::size_t room = numbers_.bytes_left();
        std::size_t corner_count = 0, used = 0;
        for (std::size_t row = 0; row < element.count; ++row) {
            const std::size_t size = used < room ? static_cast<unsigned char>(begin[used]) : 0;
            used += 1 + 4 * size;
            if (used > room) return fail(element, row, "the file ends here; it is cut off");
            if (size < 3)
                ++short_faces_;
            else
                corner_count += size;
        }
        if (corner_count >= kNoIndex) return fail_too_many();
        Mesh& mesh = file_.mesh;
        mesh.corners.resize(corner_count);
        mesh.face_offsets.resize(element.count - short_faces_ + 1);
        Index* corner = mesh.corners.data();
        Index* offset = mesh.face_offsets.data();
        const auto vertex_count = static_cast<Index>(vertex_count_);
        const char* p = begin;
        const bool swap = numbers_.swap();
        for (std::size_t row = 0; row < element.count; ++row) {
            const std::size_t size = static_cast<unsigned char>(*p++);
            bool in_range = true;
            for (std::size_t c = 0; c < size; ++c) {
                const Index index = load<Index>(p + 4 * c, swap);
                in_range &= index < vertex_count;
                if (size >= 3) *corner++ = index;
            }
            if (!in_range)
                return numbers_.skip(static_cast<std::size_t>(p - begin)),
                       fail(element, row,
                            "a corner refers to a vertex that is not there; there are " +
                                std::to_string(vertex_count_) + ", counted from 0");
            p += 4 * size;
            if (size >= 3) *++offset = static_cast<Index>(corner - mesh.corners.data());
        }
        numbers_.skip(used);
        return true;
    }

    const MeshSource& source_;
    const Header& header_;
    Numbers numbers_;
    std::optional<Error> error_;
    MeshFile file_;
    std::vector<Vec3d> world_; ///< positions that are more precise than float
    std::size_t vertex_count_ = 0, short_faces_ = 0;
    bool has_faces_ = false;
};

} // namespace

bool is_ply(std::string_view bytes) {
    return bytes.starts_with("ply\n") || bytes.starts_with("ply\r") || bytes.starts_with("ply ");
}

Result<MeshFile> read_ply(const MeshSource& source) {
    const Result<HeaderAndBody> file = read_header(source);
    if (!file.ok()) return file.error();
    const auto& [header, body] = *file;
    if (header.encoding == Encoding::ascii) return BodyReader(source, header, AsciiNumbers(source, body)).read();
    const BinaryNumbers numbers(source, body.offset(), header.encoding == Encoding::big_endian);
    return BodyReader(source, header, numbers).read();
}

} // namespace filigree
