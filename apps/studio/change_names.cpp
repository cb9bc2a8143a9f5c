#include "document.h"

#include "words.h"

#include <vector>

namespace filigree::studio {

namespace {

struct Part {
    bool is_changed;
    QString name;
};

/// The name of the part that has changed; of several: of the whole.
QString name_of(const std::vector<Part>& parts, const QString& whole) {
    QString name;
    for (const Part& part : parts) {
        if (!part.is_changed) continue;
        if (!name.isEmpty()) return whole;
        name = part.name;
    }
    return name.isEmpty() ? whole : name;
}

} // namespace

QString name_of_change(const Warps& before, const Warps& after) {
    std::vector<Part> parts = {{before.axis != after.axis, "Axis"}};
    for (const WarpInfo& info : warp_infos())
        if (info.amount != nullptr)
            parts.push_back({before.*info.amount != after.*info.amount, title_of(std::string(info.name))});
    return name_of(parts, "Deform");
}

QString name_of_change(const Shape& before, const Shape& after) {
    if (before.name != after.name) return title_of(after.name);
    const ShapeOptions &a = before.options, &b = after.options;
    return name_of({{a.frequency != b.frequency, QString("Frequency %1").arg(b.frequency)},
                    {a.resolution != b.resolution, QString("Resolution %1").arg(b.resolution)},
                    {a.amplitude != b.amplitude, QString("Amplitude %1").arg(b.amplitude)}},
                   title_of(after.name));
}

QString name_of_change(const StripOptions&, const StripOptions& after) {
    if (after.base) return "Driver of " + counted(*after.base, "vertex", "vertices");
    if (after.levels) return counted(*after.levels, "level", "levels") + " of detail";
    if (after.error) return QString("Driver within %1 % of the mesh").arg(100 * *after.error);
    return "Driver of the usual size";
}

QString name_of_change(const BodySettings& before, const BodySettings& after) {
    if (before.preset != after.preset && after.preset != "custom")
        return "Material: " + QString::fromStdString(after.preset);
    return name_of({{before.preset != after.preset || before.material != after.material, "Material"},
                    {before.particles != after.particles, counted(after.particles, "particle", "particles")},
                    {before.size != after.size, "Size of the body"},
                    {before.strength != after.strength, "Strength"},
                    {before.softest != after.softest, "Stiffness where painted"},
                    {before.drop != after.drop, "Height of the drop"},
                    {before.air_temperature != after.air_temperature, "Air"},
                    {before.melting_time != after.melting_time, "Melting time"},
                    {before.gravity != after.gravity, after.gravity ? "Gravity on" : "Gravity off"},
                    {before.ground != after.ground, after.ground ? "Ground on" : "Ground off"},
                    {before.obstacle != after.obstacle, "Obstacle"},
                    {before.friction != after.friction, "Friction"},
                    {before.restitution != after.restitution, "Bounce"}},
                   "Body");
}

} // namespace filigree::studio
