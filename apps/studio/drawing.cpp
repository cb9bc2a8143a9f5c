#include "drawing.h"

namespace filigree::studio {

Status Drawing::for_each(const std::vector<Tile>& tiles, const std::function<Status(Renderer&, const Tile&)>& draw) {
    done_ = 0;
    is_adding_ = false;
    shown_ = 0;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        if (i == pictures_.size()) {
            Result<Renderer> renderer = Renderer::create();
            if (!renderer) return renderer.error();
            pictures_.push_back({std::move(renderer).value(), 0});
        }
        pictures_[i].x = tiles[i].x;
        if (Status drawn = draw(pictures_[i].renderer, tiles[i]); !drawn) return drawn;
        ++shown_;
    }
    return Success{};
}

Status Drawing::preview(const std::vector<Tile>& tiles, const Camera& camera, unsigned height) {
    return for_each(tiles, [&](Renderer& renderer, const Tile& tile) {
        return renderer.preview(tile.scene, camera, tile.width, height);
    });
}

Status Drawing::begin(const std::vector<Tile>& tiles, const Camera& camera, unsigned height, unsigned passes) {
    Status begun = for_each(tiles, [&](Renderer& renderer, const Tile& tile) {
        return renderer.begin(tile.scene, camera, tile.width, height, passes);
    });
    is_adding_ = static_cast<bool>(begun);
    return begun;
}

bool Drawing::add_pass() {
    if (!is_adding_) return false;
    bool any = false;
    for (std::size_t i = 0; i < shown_; ++i) any = pictures_[i].renderer.add_pass() || any;
    if (any)
        ++done_;
    else
        is_adding_ = false;
    return any;
}

void Drawing::clear() {
    pictures_.clear();
    shown_ = 0;
    done_ = 0;
    is_adding_ = false;
}

void Drawing::show(unsigned framebuffer) const {
    for (std::size_t i = 0; i < shown_; ++i)
        pictures_[i].renderer.show(framebuffer, static_cast<int>(pictures_[i].x), 0);
}

} // namespace filigree::studio
