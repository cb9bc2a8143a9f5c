#include "filigree/scene/page_file.h"

#include "filigree/io/model/model_file.h"

#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace filigree {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kAligned = 8;

/// What lies behind the text.
class Parts {
public:
    /// Where it is, from behind the text on.
    Json add(std::string_view bytes) {
        bytes_.resize((bytes_.size() + kAligned - 1) / kAligned * kAligned, '\0');
        Json place{{"at", bytes_.size()}, {"bytes", bytes.size()}};
        bytes_ += bytes;
        return place;
    }
    template <class T>
    Json add(const std::vector<T>& values) {
        return add(std::string_view(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)));
    }
    std::string behind(const Json& head) const {
        std::string text = head.dump(2, ' ', false, Json::error_handler_t::replace);
        text.resize((text.size() + kAligned - 1) / kAligned * kAligned, ' ');
        std::string all = "FLGPAGE1";
        const auto length = std::uint64_t(text.size());
        all.append(reinterpret_cast<const char*>(&length), sizeof length);
        all.reserve(all.size() + text.size() + bytes_.size());
        return all.append(text).append(bytes_);
    }

private:
    std::string bytes_;
};

template <class Vector>
Json numbers(const Vector& v) {
    Json list = Json::array();
    for (int k = 0; k < 3; ++k) list.push_back(double(v[k]));
    return list;
}

/// Each model once, and which of them a body is.
Json add_bodies(const ReadyScene& ready, const DressBody& dress, Parts& parts, Json& head) {
    std::map<const Body*, std::size_t> known;
    Json bodies = Json::array(), models = Json::array();
    for (const ReadyBody& body : ready.bodies) {
        const auto [found, is_new] = known.try_emplace(body.body.get(), known.size());
        if (is_new) {
            const std::optional<Model> dressed = dress ? dress(body) : std::nullopt;
            models.push_back(parts.add(write_model(dressed ? *dressed : body.model)));
        }
        bodies.push_back({{"name", body.name},
                          {"model", found->second},
                          {"scale", body.scale},
                          {"color", numbers(body.color)},
                          {"own_color", body.has_own_color},
                          {"breaks", !body.pieces.empty()}});
    }
    head["models"] = models;
    return bodies;
}

Json add_obstacles(const SceneFile& scene, const ReadyScene& ready, Parts& parts) {
    Json obstacles = Json::array();
    std::size_t drawn = 0;
    for (std::size_t number = 0; number < scene.obstacles.size(); ++number) {
        if (!scene.obstacles[number].visible) continue;
        const ShownObstacle& shown = ready.drawn[drawn++];
        Json obstacle{{"number", number}, {"color", numbers(shown.color)}};
        if (shown.is_ground) {
            obstacle["point"] = numbers(shown.plane.point);
            obstacle["normal"] = numbers(shown.plane.normal);
        } else {
            obstacle["positions"] = parts.add(shown.mesh.positions);
            std::vector<Triangle> triangles;
            for (std::size_t f = 0; f < shown.mesh.face_count(); ++f) {
                const std::span<const Index> face = shown.mesh.face(f);
                for (std::size_t k = 2; k < face.size(); ++k) triangles.push_back({face[0], face[k - 1], face[k]});
            }
            obstacle["triangles"] = parts.add(triangles);
        }
        obstacles.push_back(obstacle);
    }
    return obstacles;
}

} // namespace

LiveWorld live_world(const SceneFile& scene, const ReadyScene& ready) {
    LiveWorld live{ready.world, ready.actors, scene.step, {}};
    for (std::size_t b = 0; b < ready.bodies.size(); ++b) {
        const ReadyBody& body = ready.bodies[b];
        live.attached.push_back({b, body.in_metres(driver_positions(body.model)), body.pieces.driver});
    }
    return live;
}

Result<PageFile> write_page_file(const SceneFile& scene, const ReadyScene& ready, const DressBody& dress) {
    const Result<std::string> world = write_live_world(live_world(scene, ready));
    if (!world) return world.error();
    Parts parts;
    Json head{{"up", std::string(1, "xyz"[int(scene.picture.up)])},
              {"frame_rate", scene.step.frames_per_second},
              {"gravity", numbers(ready.world.gravity)}};
    head["world"] = parts.add(*world);
    head["bodies"] = add_bodies(ready, dress, parts, head);
    head["obstacles"] = add_obstacles(scene, ready, parts);
    return PageFile{parts.behind(head), world->size()};
}

} // namespace filigree
