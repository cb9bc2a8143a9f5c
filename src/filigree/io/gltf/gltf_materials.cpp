// Materials of a glTF file: base colour, opacity, metal, roughness, and the base colour's picture.
#include "filigree/core/srgb.h"
#include "filigree/io/gltf/gltf_scene.h"

#include <algorithm>
#include <set>

namespace filigree::gltf {

namespace {

class MaterialReader {
public:
    MaterialReader(Document& document, std::vector<std::string>& warnings) : document_(document), warnings_(warnings) {}

    Materials read() {
        Materials read;
        for (std::size_t m = 0; m < document_.count("materials"); ++m) {
            const Value place = document_.item("materials", m);
            if (is_none(place)) {
                read.number.push_back(kNoIndex);
                read.uvs.emplace_back();
                continue;
            }
            read.number.push_back(static_cast<Index>(read.materials.size()));
            read.materials.push_back(material(place, m, read.uvs.emplace_back()));
        }
        return read;
    }

private:
    /// Our own writer's stand-in for faces without a material.
    static bool is_none(const Value& place) {
        const Value extras = place["extras"];
        if (!extras || !extras.json().is_object()) return false;
        const Value note = extras["filigree"];
        return note && note.json().is_string() && note.text() == "none";
    }

    /// uvs: gets what its picture is laid by.
    MeshMaterial material(const Value& place, std::size_t number, UvUse& uvs) {
        MeshMaterial material;
        const Value name = place["name"], surface = place["pbrMetallicRoughness"];
        const Value glossy = place["extensions"]["KHR_materials_pbrSpecularGlossiness"];
        material.name = unique(name && name.json().is_string() ? name.text() : "", number);
        double color[4] = {1, 1, 1, 1};
        if (glossy)
            glossy["diffuseFactor"].numbers(color, 4);
        else
            surface["baseColorFactor"].numbers(color, 4);
        for (int k = 0; k < 3; ++k) material.color[k] = static_cast<float>(srgb_from_linear(color[k]));
        if (place["alphaMode"].text("OPAQUE") == "BLEND")
            material.opacity = static_cast<float>(std::clamp(color[3], 0.0, 1.0));
        const double metallic = glossy ? 0 : surface["metallicFactor"].number(1);
        const double roughness =
            glossy ? 1 - glossy["glossinessFactor"].number(1) : surface["roughnessFactor"].number(1);
        material.metallic = static_cast<float>(std::clamp(metallic, 0.0, 1.0));
        material.roughness = static_cast<float>(std::clamp(roughness, 0.0, 1.0));
        material.double_sided = place["doubleSided"].flag(false);
        if (const Value texture = glossy ? glossy["diffuseTexture"] : surface["baseColorTexture"]) {
            material.picture_bytes = picture(texture);
            if (material.picture_bytes) uvs = uv_use(texture);
        }
        return material;
    }

    /// Names stand for materials in other formats, so each has its own.
    std::string unique(const std::string& name, std::size_t number) {
        const std::string wanted = name.empty() ? "material_" + std::to_string(number) : name;
        std::string chosen = wanted;
        for (std::size_t again = number + 1; !names_.insert(chosen).second; ++again)
            chosen = wanted + "_" + std::to_string(again);
        return chosen;
    }

    static UvUse uv_use(const Value& texture) {
        UvUse use;
        use.set = texture["texCoord"].whole(0);
        const Value transform = texture["extensions"]["KHR_texture_transform"];
        if (!transform) return use;
        transform["offset"].numbers(use.offset, 2);
        transform["scale"].numbers(use.scale, 2);
        use.rotation = transform["rotation"].number(0);
        use.set = transform["texCoord"].whole(use.set);
        return use;
    }

    /// Null with a warning where it cannot be had: a mesh can be drawn without.
    std::shared_ptr<const std::string> picture(const Value& texture) {
        const std::size_t number = texture["index"].index(document_.count("textures"), "textures");
        const Value source = document_.item("textures", number)["source"];
        if (!source) {
            warnings_.push_back(texture.path() + ": has no PNG or JPEG picture; left out.");
            return nullptr;
        }
        const std::size_t image = source.index(document_.count("images"), "images");
        const auto [entry, is_new] = pictures_.try_emplace(image);
        if (!is_new) return entry->second;
        try {
            std::string bytes = document_.picture(image);
            document_.charge(bytes.size(), source.path());
            entry->second = std::make_shared<const std::string>(std::move(bytes));
        } catch (const Damage& damage) {
            warnings_.push_back(damage.what + " The picture was left out.");
        }
        return entry->second;
    }

    Document& document_;
    std::vector<std::string>& warnings_;
    std::set<std::string> names_;
    std::map<std::size_t, std::shared_ptr<const std::string>> pictures_;
};

} // namespace

Materials read_materials(Document& document, std::vector<std::string>& warnings) {
    return MaterialReader(document, warnings).read();
}

} // namespace filigree::gltf
