// One picture or several side by side: quickly while things move, pass by pass when they are still.
#pragma once

#include "filigree/render.h"

#include <functional>
#include <vector>

namespace filigree::studio {

/// Part of the picture, with the same camera as the others. Pixels from the left.
struct Tile {
    Scene scene;
    unsigned x = 0, width = 1;
};

/// All functions with OpenGL current. What the scenes draw must live until the next preview() or begin().
class Drawing {
public:
    /// Errors of both: as Renderer's.
    Status preview(const std::vector<Tile>& tiles, const Camera& camera, unsigned height);
    /// passes: of every tile; 0 for as many as suit its size.
    Status begin(const std::vector<Tile>& tiles, const Camera& camera, unsigned height, unsigned passes);
    /// The next pass of every tile; false: all are done.
    bool add_pass();
    void stop() { is_adding_ = false; } ///< no more passes; what is shown stays
    bool is_adding() const { return is_adding_; }
    unsigned passes_done() const { return done_; }
    /// Whether the sum of the passes looks better than a preview.
    bool is_good_enough() const { return done_ >= kGoodPasses || (done_ > 0 && !is_adding_); }
    void show(unsigned framebuffer) const;
    void clear(); ///< gives back what is in graphics memory: nothing is shown

private:
    static constexpr unsigned kGoodPasses = 6; ///< shadows of six lights are no longer taken for six shadows

    struct Picture {
        Renderer renderer;
        unsigned x = 0;
    };
    Status for_each(const std::vector<Tile>& tiles, const std::function<Status(Renderer&, const Tile&)>& draw);

    std::vector<Picture> pictures_; ///< may be more than are shown
    std::size_t shown_ = 0;
    unsigned done_ = 0;
    bool is_adding_ = false;
};

} // namespace filigree::studio
