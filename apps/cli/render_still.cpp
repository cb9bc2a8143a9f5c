// Pictures: one file, or several side by side with captions and a legend.
#include "rendering.h"

#include <cmath>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

constexpr double kCaptionHeight = 34, kGap = 10; // pixels

/// Where the panels of a page stand: rows of equal boxes, a caption below each, the legend at the right.
struct PanelLayout {
    unsigned columns = 1, rows = 1, width = 0, height = 0; ///< of a panel
    double caption = 0, legend = 0;
    PictureSize page;

    PanelLayout(std::size_t count, const PictureSize& wanted, bool captions, bool has_legend)
        : caption(captions ? kCaptionHeight : 0), legend(has_legend ? kLegendWidth : 0) {
        columns = static_cast<unsigned>(count <= 4 ? count : std::size_t(std::ceil(std::sqrt(double(count)))));
        rows = static_cast<unsigned>((count + columns - 1) / columns);
        page = wanted;
        if (page.width == 0)
            page = count == 1 ? PictureSize{1280 + unsigned(legend), 960 + unsigned(caption)}
                              : PictureSize{columns * 720 + unsigned(legend), rows * unsigned(620 + caption)};
        const double w = (page.width - legend - kGap * (columns - 1)) / columns;
        const double h = double(page.height) / rows - caption;
        if (w < 16 || h < 16)
            refuse(fmt::format("--size: {} pictures with their captions do not fit into {}x{} pixels; make it larger.",
                               count, page.width, page.height));
        width = static_cast<unsigned>(w);
        height = static_cast<unsigned>(h);
    }
    Point corner(std::size_t panel) const {
        return {double(panel % columns) * (width + kGap), double(panel / columns) * (height + caption)};
    }
};

class Still : public Rendering {
public:
    Still(const RenderOptions& options, Session& session)
        : Rendering(options, session), count_(options.files.size()),
          has_captions_(!options.no_captions && (count_ > 1 || !options.captions.empty())),
          layout_(count_, options.size, has_captions_, has_scalars()), page_(layout_.page.width, layout_.page.height),
          subjects_(count_) {}

    void draw() {
        const double start = now_seconds();
        if (options_.shared_camera || (has_scalars() && options_.range.empty() && count_ > 1)) read_all();
        for (std::size_t i = 0; i < count_; ++i) draw_panel(i);
        if (has_scalars())
            page_.legend(options_.map, range_, Page::plain(title_), {layout_.page.width - kLegendWidth + 14, 24},
                         std::min(420.0, layout_.page.height - 60.0));
        session_.begin_writing(options_.output);
        if (alone_.width)
            write_picture(alone_, options_.output, session_);
        else
            require(page_.write(path_of(options_.output), 1));
        report("", layout_.page, 1, now_seconds() - start);
    }

private:
    double aspect() const { return double(layout_.width) / layout_.height; }

    /// With one camera or one range for all, all are read first.
    void read_all() {
        std::vector<CameraPoints> points;
        std::vector<std::vector<Vec3f>> rooms(count_);
        std::vector<float> values;
        for (std::size_t i = 0; i < count_; ++i) {
            subjects_[i] = read(options_.files[i]);
            if (options_.frame > 0) set_pose(*subjects_[i], subjects_[i]->poses.frames[options_.frame - 1], false);
            points.push_back(shown_points(*subjects_[i], rooms[i]));
            values.insert(values.end(), subjects_[i]->scalars.begin(), subjects_[i]->scalars.end());
        }
        if (options_.shared_camera) shared_ = camera_for(points, aspect());
        range_ = range_of(values);
        range_known_ = true;
    }

    void draw_panel(std::size_t i) {
        if (!subjects_[i]) subjects_[i] = read(options_.files[i]);
        Subject& subject = *subjects_[i];
        if (!range_known_) range_ = range_of(subject.scalars);
        upload(subject);
        if (!options_.poses.empty()) set_pose(subject, read_pose(subject, options_.poses[0]), true);
        if (options_.frame > 0) set_pose(subject, subject.poses.frames[options_.frame - 1], true);
        std::vector<Vec3f> room;
        const CameraPoints points = shown_points(subject, room, subject.drawable->point_radius());
        const Camera camera = shared_ ? *shared_ : camera_for(std::span(&points, 1), aspect());
        Picture picture = require(
            renderer_.picture(scene_of(subject), camera, picture_options(layout_.width, layout_.height), context()));
        title_ = subject.scalar_title;
        subjects_[i].reset();
        if (count_ == 1 && !has_captions_ && !has_scalars() && lower_extension(path_of(options_.output)) == ".png") {
            alone_ = std::move(picture);
            return;
        }
        const Point corner = layout_.corner(i);
        page_.picture(picture, corner, layout_.width, layout_.height);
        if (has_captions_)
            page_.text(i < options_.captions.size() ? options_.captions[i] : Page::plain(file_name(options_.files[i])),
                       {corner.x() + 0.5 * layout_.width, corner.y() + layout_.height + 22},
                       {.size = 15, .align = Align::centre});
    }

    std::size_t count_;
    bool has_captions_;
    PanelLayout layout_;
    Page page_;
    std::vector<std::unique_ptr<Subject>> subjects_;
    std::optional<Camera> shared_;
    std::string title_;
    Picture alone_; ///< one picture that needs no page
};

} // namespace

void render_still(const RenderOptions& options, Session& session) { Still(options, session).draw(); }

} // namespace filigree::cli
