#include "filigree/physics/step/live_world.h"

#include "filigree/physics/breaking/broken_body.h"
#include "filigree/physics/contact/obstacle_surface.h"
#include "filigree/physics/step/byte_stream.h"

#include <limits>
#include <type_traits>
#include <unordered_map>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

constexpr std::uint64_t kLiveMagic = 0x41455649'4c474c46; // "FLGLIVEA": the version is the last letter

/// What every struct is made of, in one place for writing and for reading: a value, or an array of plain values.
class Writing {
public:
    static constexpr bool reads = false;
    template <class T>
    void value(const T& value) {
        if constexpr (std::is_same_v<T, std::size_t>)
            bytes_.value(std::uint64_t(value));
        else
            bytes_.value(value);
    }
    void flag(const bool& value) { bytes_.value(std::uint8_t(value)); }
    template <class T>
    void array(const std::vector<T>& values) {
        bytes_.array(std::span(values));
    }
    template <class T, class Visit>
    void each(const std::vector<T>& values, const Visit& visit) {
        bytes_.value(std::uint64_t(values.size()));
        for (const T& value : values) visit(value);
    }
    void vectors(const Vectors& values) {
        bytes_.value(std::uint64_t(values.size()));
        bytes_.vectors(values);
    }
    bool ok() const { return true; }
    std::string take() { return bytes_.take(); }

private:
    ByteWriter bytes_;
};

class Reading {
public:
    static constexpr bool reads = true;
    explicit Reading(std::string_view bytes) : bytes_(bytes) {}
    template <class T>
    void value(T& value) {
        if constexpr (std::is_same_v<T, std::size_t>)
            value = std::size_t(bytes_.value<std::uint64_t>());
        else
            value = bytes_.value<T>();
    }
    void flag(bool& value) { value = bytes_.value<std::uint8_t>() != 0; }
    template <class T>
    void array(std::vector<T>& values) {
        values = bytes_.array<T>();
    }
    template <class T, class Visit>
    void each(std::vector<T>& values, const Visit& visit) {
        values.resize(bytes_.count(1));
        for (T& value : values)
            if (bytes_.ok()) visit(value);
    }
    void vectors(Vectors& values) { values = bytes_.vectors(bytes_.count(3 * sizeof(float))); }
    bool ok() const { return bytes_.ok(); }
    bool at_end() const { return bytes_.at_end(); }

private:
    ByteReader bytes_;
};

/// Things that several others share, each once, by their numbers.
template <class T>
struct Shared {
    std::vector<std::shared_ptr<const T>> all;
    std::unordered_map<const T*, Index> numbers;

    Index number_of(const std::shared_ptr<const T>& item) {
        if (!item) return kNoIndex;
        const auto [found, is_new] = numbers.try_emplace(item.get(), Index(all.size()));
        if (is_new) all.push_back(item);
        return found->second;
    }
    std::shared_ptr<const T> at(Index number) const { return number < all.size() ? all[number] : nullptr; }
};

template <class Stream, class Vector>
void pass_vector(Stream& stream, Vector& v) {
    for (Eigen::Index k = 0; k < v.size(); ++k) stream.value(v.data()[k]);
}

template <class Stream, class Keys>
void pass_keys(Stream& stream, Keys& keyed) {
    stream.array(keyed.times);
    if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(keyed.constant)>>) {
        stream.array(keyed.values);
        stream.value(keyed.constant);
    } else {
        stream.each(keyed.values, [&](auto& value) { pass_vector(stream, value); });
        pass_vector(stream, keyed.constant);
    }
}

template <class Stream, class Pose>
void pass_pose(Stream& stream, Pose& pose) {
    pass_vector(stream, pose.matrix());
}

template <class Stream, class Motion>
void pass_motion(Stream& stream, Motion& motion) {
    pass_vector(stream, motion.centre);
    pass_keys(stream, motion.move);
    pass_keys(stream, motion.angle);
    pass_pose(stream, motion.start);
}

template <class Stream, class Of>
void pass_material(Stream& stream, Of& m) {
    stream.value(m.model);
    for (auto* number : {&m.density, &m.young_modulus, &m.poisson_ratio, &m.damping, &m.internal_damping, &m.bending,
                         &m.yield_stress, &m.creep_time, &m.temperature, &m.melting_from, &m.melting_to, &m.viscosity,
                         &m.heating, &m.conductivity, &m.specific_heat, &m.latent_heat})
        stream.value(*number);
}

template <class Stream, class Of>
void pass_embedding(Stream& stream, Of& embedding) {
    stream.array(embedding.rest);
    stream.array(embedding.offsets);
    stream.array(embedding.particles);
    stream.array(embedding.weights);
}

template <class Stream, class Of>
void pass_box(Stream& stream, Of& box) {
    pass_vector(stream, box.min);
    pass_vector(stream, box.max);
}

template <class Stream, class Of>
void pass_cells(Stream& stream, Of& cells) {
    stream.value(cells.spacing);
    pass_vector(stream, cells.origin);
    stream.array(cells.cells);
    stream.array(cells.corners);
    stream.array(cells.cell_corners);
    stream.array(cells.fraction);
    stream.array(cells.centroid);
    stream.array(cells.runs);
    stream.each(cells.homes, [&](auto& home) {
        for (auto& at : home.at) stream.value(at);
        stream.value(home.cubes);
        stream.value(home.cell);
    });
}

template <class Stream, class Of>
void pass_lists(Stream& stream, Of& lists) {
    stream.array(lists.offsets);
    stream.array(lists.items);
}

} // namespace

/// What other classes keep to themselves.
struct WorldParts {
    template <class Stream, class Of>
    static void pass_field(Stream& stream, Of& field) {
        pass_box(stream, field.box_);
        pass_vector(stream, field.corner_);
        stream.value(field.spacing_);
        for (auto& count : field.counts_) stream.value(count);
        stream.array(field.distances_);
    }
    static std::shared_ptr<DistanceField> new_field() { return std::shared_ptr<DistanceField>(new DistanceField); }

    template <class Stream, class Of>
    static void pass_surface(Stream& stream, Of& surface) {
        stream.array(surface.positions_);
        stream.array(surface.triangles_);
        stream.flag(surface.is_closed_);
        stream.flag(surface.looked_inwards_);
        if constexpr (Stream::reads)
            if (stream.ok()) surface.prepare();
    }
    static ObstacleSurface new_surface() { return {}; }
};

namespace {

/// All of a world, in the order of the bytes: fields, bodies, broken bodies, then what refers to them.
template <class Stream>
class Passing {
public:
    explicit Passing(Stream& stream) : stream_(stream) {}

    Shared<DistanceField> fields;
    Shared<Body> bodies;
    Shared<BrokenBody> broken;

    template <class Live>
    void run(Live& live) {
        pass_shared(fields, WorldParts::new_field, [this](auto& field) { WorldParts::pass_field(stream_, field); });
        pass_shared(bodies, std::make_shared<Body>, [this](auto& body) { pass_body(body); });
        pass_shared(broken, std::make_shared<BrokenBody>, [this](auto& of) { pass_broken(of); });
        pass_world(live.world);
        stream_.each(live.actors, [this](auto& actor) { pass_actor(actor); });
        pass_options(live.options);
        stream_.each(live.attached, [this](auto& points) {
            stream_.value(points.body);
            stream_.array(points.points);
            stream_.array(points.pieces);
        });
    }

private:
    template <class T, class Make, class Visit>
    void pass_shared(Shared<T>& shared, const Make& make, const Visit& visit) {
        stream_.each(shared.all, [&](auto& item) {
            if constexpr (Stream::reads) {
                const std::shared_ptr<T> made = make();
                visit(*made);
                item = made;
            } else {
                visit(*item);
            }
        });
    }

    template <class T, class Pointer>
    void pass_number(Shared<T>& shared, Pointer& pointer) {
        if constexpr (Stream::reads) {
            Index number = kNoIndex;
            stream_.value(number);
            pointer = shared.at(number);
        } else {
            stream_.value(shared.number_of(pointer));
        }
    }

    template <class Of>
    void pass_body(Of& body) {
        pass_material(stream_, body.material);
        stream_.value(body.scale);
        pass_cells(stream_, body.cells);
        stream_.vectors(body.rest);
        stream_.array(body.mass);
        stream_.array(body.volume);
        pass_embedding(stream_, body.corners);
        pass_embedding(stream_, body.surface.points);
        stream_.array(body.surface.normals);
        stream_.array(body.surface.areas);
        pass_number(fields, body.field);
        stream_.value(body.field_radius);
        for (auto* field : {&body.fields.stiffness, &body.fields.density, &body.fields.damping,
                            &body.fields.yield_stress, &body.fields.strength})
            stream_.array(*field);
    }

    template <class Of>
    void pass_broken(Of& of) {
        pass_number(bodies, of.whole);
        stream_.each(of.pieces, [this](auto& piece) { pass_number(bodies, piece); });
        for (auto* numbers : {&of.piece_of_number, &of.number_of_piece, &of.copy_offsets, &of.outer_points})
            stream_.array(*numbers);
        for (auto* lists : {&of.corners_of_whole, &of.cells_of_whole})
            stream_.each(*lists, [this](auto& list) { stream_.array(list); });
        stream_.array(of.copies);
        stream_.array(of.facets);
        stream_.array(of.links);
        for (auto* lists : {&of.facets_of_link, &of.links_beside, &of.points_of_link}) pass_lists(stream_, *lists);
        if constexpr (Stream::reads) {
            of.partition.count = Index(of.piece_of_number.size());
            of.partition.piece_at = nearest_piece(of);
        }
    }

    static std::function<Index(const Vec3d&)> nearest_piece(const BrokenBody& of) {
        return [numbers = of.number_of_piece, pieces = of.pieces, outer = of.outer_points](const Vec3d& place) {
            const Vec3f at = place.cast<float>();
            Index nearest = 0;
            float least = std::numeric_limits<float>::infinity();
            for (std::size_t piece = 0; piece < pieces.size(); ++piece)
                for (Index point = 0; point < outer[piece]; ++point) {
                    const float distance = (pieces[piece]->surface.points.rest[point] - at).squaredNorm();
                    if (!(distance < least)) continue;
                    least = distance;
                    nearest = numbers[piece];
                }
            return nearest;
        };
    }

    template <class Of>
    void pass_shape(Of& shape) {
        Index kind = Index(shape.index());
        if constexpr (Stream::reads) {
            stream_.value(kind);
            if (kind == 0) shape = HalfSpace{};
            if (kind == 1) shape = Ball{};
            if (kind == 2) shape = Cuboid{};
            if (kind == 3) shape = MeshObstacle{};
        } else {
            stream_.value(kind);
        }
        std::visit([this](auto& of) { pass_shape_of(of); }, shape);
    }
    template <class Of>
    void pass_shape_of(Of& of) {
        using Shape = std::remove_const_t<Of>;
        if constexpr (std::is_same_v<Shape, HalfSpace>) {
            pass_vector(stream_, of.point);
            pass_vector(stream_, of.normal);
        } else if constexpr (std::is_same_v<Shape, Ball>) {
            pass_vector(stream_, of.centre);
            stream_.value(of.radius);
        } else if constexpr (std::is_same_v<Shape, Cuboid>) {
            pass_vector(stream_, of.centre);
            pass_vector(stream_, of.size);
        } else {
            pass_number(fields, of.field);
            pass_vector(stream_, of.offset);
            bool has_surface = of.surface != nullptr;
            stream_.flag(has_surface);
            if constexpr (Stream::reads) {
                if (!has_surface) return;
                ObstacleSurface surface = WorldParts::new_surface();
                WorldParts::pass_surface(stream_, surface);
                of.surface = std::make_shared<const ObstacleSurface>(std::move(surface));
            } else if (has_surface) {
                WorldParts::pass_surface(stream_, *of.surface);
            }
        }
    }

    template <class Of>
    void pass_contact(Of& contact) {
        stream_.value(contact.friction);
        stream_.value(contact.restitution);
    }
    template <class Of>
    void pass_numbers(Of& numbers) {
        stream_.each(numbers, [this](auto& number) { stream_.value(number); });
    }

    template <class Of>
    void pass_world(Of& world) {
        pass_vector(stream_, world.gravity);
        pass_keys(stream_, world.wind);
        stream_.value(world.air_density);
        stream_.each(world.obstacles, [this](auto& obstacle) {
            pass_shape(obstacle.shape);
            pass_motion(stream_, obstacle.motion);
            stream_.value(obstacle.friction);
            stream_.value(obstacle.restitution);
            stream_.value(obstacle.stiffness);
        });
        stream_.each(world.pins, [this](auto& pin) {
            stream_.value(pin.body);
            stream_.array(pin.particles);
            pass_motion(stream_, pin.motion);
        });
        stream_.each(world.forces, [this](auto& force) {
            stream_.value(force.body);
            stream_.array(force.particles);
            pass_keys(stream_, force.force);
        });
        stream_.each(world.hands, [this](auto& hand) {
            stream_.value(hand.body);
            pass_vector(stream_, hand.point);
            stream_.value(hand.stiffness);
            pass_keys(stream_, hand.target);
            stream_.value(hand.from);
            stream_.value(hand.until);
        });
        stream_.value(world.body_friction);
        stream_.value(world.body_restitution);
        stream_.each(world.body_pairs, [this](auto& pair) {
            stream_.value(pair.first);
            stream_.value(pair.second);
            pass_contact(pair.contact);
        });
        stream_.each(world.group_pairs, [this](auto& pair) {
            pass_numbers(pair.first);
            pass_numbers(pair.second);
            pass_contact(pair.contact);
        });
    }

    template <class Of>
    void pass_fracture(Of& fracture) {
        pass_number(broken, fracture.body);
        for (auto* number : {&fracture.material.strength, &fracture.material.scatter, &fracture.material.energy,
                             &fracture.material.plastic_opening})
            stream_.value(*number);
        stream_.value(fracture.material.seed);
        stream_.each(fracture.events, [this](auto& event) {
            stream_.value(event.time);
            stream_.array(event.pieces);
            stream_.array(event.particles);
        });
    }

    template <class Of>
    void pass_actor(Of& actor) {
        pass_number(bodies, actor.body);
        pass_pose(stream_, actor.placement);
        pass_vector(stream_, actor.velocity);
        pass_vector(stream_, actor.spin);
        stream_.flag(actor.may_sleep);
        bool breaks = actor.fracture != nullptr;
        stream_.flag(breaks);
        if constexpr (Stream::reads) {
            if (!breaks) return;
            auto fracture = std::make_shared<Fracture>();
            pass_fracture(*fracture);
            actor.fracture = fracture;
        } else if (breaks) {
            pass_fracture(*actor.fracture);
        }
    }

    template <class Of>
    void pass_options(Of& options) {
        stream_.value(options.frames_per_second);
        stream_.value(options.mode);
        stream_.flag(options.contacts_between_bodies);
        stream_.flag(options.contacts_within_bodies);
        stream_.flag(options.automatic_rigid);
        stream_.value(options.most_substeps);
    }

    Stream& stream_;
};

static_assert(sizeof(CrackFacet) == 25 * sizeof(Index), "padding would be written");
static_assert(sizeof(CrackLink) == 6 * sizeof(Index) && sizeof(CornerCopy) == 2 * sizeof(Index) &&
                  sizeof(Cells::Run) == 6 * sizeof(Index),
              "padding would be written");

} // namespace

Result<std::string> write_live_world(const LiveWorld& live) {
    Writing stream;
    Passing<Writing> passing(stream);
    const auto take_body = [&](const std::shared_ptr<const Body>& body) {
        passing.bodies.number_of(body);
        passing.fields.number_of(body->field);
    };
    for (const Actor& actor : live.actors) {
        if (actor.body->material.model == MaterialModel::mpm)
            return Error{ErrorCode::unsuitable,
                         "A body of the model mpm (matter that melts and flows) does not move in a page."};
        take_body(actor.body);
        if (!actor.fracture) continue;
        take_body(actor.fracture->body->whole);
        for (const std::shared_ptr<const Body>& piece : actor.fracture->body->pieces) take_body(piece);
        passing.broken.number_of(actor.fracture->body);
    }
    for (const Obstacle& obstacle : live.world.obstacles)
        if (const auto* mesh = std::get_if<MeshObstacle>(&obstacle.shape)) passing.fields.number_of(mesh->field);
    stream.value(kLiveMagic);
    passing.run(live);
    std::string bytes = stream.take();
    ByteWriter sum;
    sum.value(std::uint64_t{XXH3_64bits(bytes.data(), bytes.size())});
    return bytes + sum.take();
}

Result<LiveWorld> read_live_world(std::string_view bytes) {
    const Error damaged{ErrorCode::bad_file,
                        "The bodies of the page are damaged or of another version; export the page "
                        "again."};
    if (ByteReader(bytes).value<std::uint64_t>() != kLiveMagic) return damaged;
    const std::string_view contents = bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
    const auto sum = ByteReader(bytes.substr(contents.size())).value<std::uint64_t>();
    if (sum != XXH3_64bits(contents.data(), contents.size())) return damaged;
    Reading stream(contents.substr(sizeof kLiveMagic));
    LiveWorld live;
    Passing<Reading>(stream).run(live);
    if (!stream.ok() || !stream.at_end()) return damaged;
    return live;
}

} // namespace filigree
