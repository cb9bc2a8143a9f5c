#include "filigree/physics/contact/contact_events.h"

#include "filigree/physics/rigid/rigid_contacts.h"

#include <algorithm>
#include <tuple>

namespace filigree {

namespace {

constexpr double kNothing = 1e-12; ///< N s: what touches without a force has a place, too

auto key_of(const ContactEvent& event) {
    return std::tuple(event.body, event.other.has_value(), event.other.value_or(event.obstacle.value_or(0)));
}

ContactEvents::PairMemory remembered(const ContactEvent& event) {
    return {event.body,
            event.other.value_or(event.obstacle.value_or(0)),
            event.other.has_value(),
            0,
            event.place.cast<float>(),
            event.normal.cast<float>()};
}

ContactEvent recalled(const ContactEvents::PairMemory& pair, ContactKind kind) {
    ContactEvent event;
    event.kind = kind;
    event.body = pair.body;
    (pair.is_body ? event.other : event.obstacle) = pair.other;
    event.place = pair.place.cast<double>();
    event.normal = pair.normal.cast<double>();
    return event;
}

/// Numbers of the actors that sleep, ascending.
std::vector<std::size_t> sleeping_actors(std::span<const BodyState> bodies) {
    std::vector<std::size_t> sleeping;
    for (const BodyState& body : bodies)
        if (body.rigid && body.rigid->sleeps) sleeping.push_back(body.actor);
    std::ranges::sort(sleeping);
    return sleeping;
}

} // namespace

void ContactEvents::Sum::add(const Sum& more) {
    weight += more.weight;
    impulse += more.impulse;
    speed = std::max(speed, more.speed);
    place += more.place;
    normal += more.normal;
}

void ContactEvents::add(std::vector<Sum>& sums, const Sum& more) {
    const auto found = std::ranges::find(sums, more.other, &Sum::other);
    if (found == sums.end())
        sums.push_back(more);
    else
        found->add(more);
}

void ContactEvents::add(std::vector<Sum>& sums, ColliderId other, const Vec3f& place, const Vec3f& normal,
                        float impulse, float approach) {
    const double pushed = std::max(0.0, double(impulse)), weight = pushed + kNothing;
    add(sums, {.other = other,
               .weight = weight,
               .impulse = pushed,
               .speed = std::max(0.0f, approach),
               .place = weight * place.cast<double>(),
               .normal = weight * normal.cast<double>()});
}

void ContactEvents::begin_frame() {
    for (std::vector<Sum>& sums : kept_) sums.clear();
    begin_forces();
}

void ContactEvents::begin_forces() {
    for (std::vector<Sum>& sums : found_) sums.clear();
}

void ContactEvents::keep_forces() {
    for (std::size_t b = 0; b < found_.size(); ++b)
        for (const Sum& sum : found_[b]) add(kept_[b], sum);
    begin_forces();
}

void ContactEvents::push(std::span<const ContactPoint> points) {
    for (const ContactPoint& point : points) {
        if (!(point.impulse > 0)) continue;
        const bool is_body = point.other != kNoIndex;
        push(point.body, is_body ? ColliderId::body(point.other) : ColliderId::obstacle(point.obstacle), point.place,
             point.normal, point.impulse, point.approach);
    }
}

/// One event of each two, ascending. Parts of one body do not count.
std::vector<ContactEvent> ContactEvents::touching(std::span<const BodyState> bodies) const {
    std::vector<std::pair<ContactEvent, Sum>> found;
    for (std::size_t b = 0; b < kept_.size(); ++b)
        for (Sum sum : kept_[b]) {
            ContactEvent event;
            event.body = bodies[b].actor;
            if (sum.other.is_obstacle()) {
                event.obstacle = sum.other.number();
            } else {
                event.other = bodies[sum.other.number()].actor;
                if (*event.other == event.body) continue;
                if (*event.other < event.body) {
                    std::swap(*event.other, event.body);
                    sum.normal = -sum.normal;
                }
            }
            found.emplace_back(event, sum);
        }
    std::ranges::stable_sort(found, {}, [](const auto& entry) { return key_of(entry.first); });
    std::vector<ContactEvent> events;
    for (std::size_t k = 0; k < found.size(); ++k) {
        Sum sum = found[k].second;
        while (k + 1 < found.size() && key_of(found[k + 1].first) == key_of(found[k].first)) sum.add(found[++k].second);
        ContactEvent& event = events.emplace_back(found[k].first);
        event.place = sum.place / sum.weight;
        event.normal = sum.normal.stableNormalized();
        event.impulse = sum.impulse;
        event.speed = double(sum.speed);
    }
    return events;
}

void ContactEvents::end_frame(std::span<const BodyState> bodies) {
    std::vector<ContactEvent> events = touching(bodies);
    const std::vector<std::size_t> sleeping = sleeping_actors(bodies);
    const auto sleeps = [&](std::size_t actor) { return std::ranges::binary_search(sleeping, actor); };
    const std::size_t count = events.size();
    std::size_t next = 0; // of this frame's, beside those of the last one
    for (const PairMemory& pair : pairs_) {
        const ContactEvent before = recalled(pair, ContactKind::ended);
        while (next < count && key_of(events[next]) < key_of(before)) ++next;
        if (next < count && key_of(events[next]) == key_of(before)) {
            events[next].kind = ContactKind::stays;
            continue;
        }
        const bool rests = sleeps(pair.body) && (!pair.is_body || sleeps(pair.other)); // nothing was computed for it
        events.push_back(recalled(pair, rests ? ContactKind::stays : ContactKind::ended));
    }
    std::ranges::sort(events, {}, [](const ContactEvent& event) { return key_of(event); });
    pairs_.clear();
    for (const ContactEvent& event : events)
        if (event.kind != ContactKind::ended) pairs_.push_back(remembered(event));
    events_ = std::move(events);
}

} // namespace filigree
