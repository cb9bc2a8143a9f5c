// Films: what changes from frame to frame is the pose, the file or the camera.
#include "chunks.h"
#include "draft.h"
#include "rendering.h"

#include "filigree/io/system/file_batch.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/io/system/platform.h"
#include "filigree/present/film_frames.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

class RenderedFilm : public Rendering {
public:
    RenderedFilm(const RenderOptions& options, Session& session)
        : Rendering(options, session), by_file_(options.poses.empty() && options.files.size() > 1),
          subject_(read(options.files[0])) {
        // Poses that the model holds play by themselves, unless one of them or others are asked for.
        is_own_ = !by_file_ && options.poses.empty() && !subject_->poses.empty();
        by_pose_ = !options.poses.empty() || is_own_;
        moments_ = by_file_            ? options.files.size()
                   : !by_pose_         ? 1
                   : !is_own_          ? options.poses.size()
                   : options.frame > 0 ? 1
                                       : subject_->poses.frames.size();
        if (moments_ == 1 && !options.turntable && !is_own_)
            refuse("A film needs a model with poses, several files or several --poses to show one after the other, or "
                   "--turntable.");
        if (is_own_ && has_scalars() && options.scalar != "level") refuse(kPosesWithoutScalars);
        frames_ = options.turntable ? std::max<std::size_t>(options.frames, moments_) : moments_;
        if (options.size.width) size_ = options.size;
        if (options.draft) {
            const auto [width, height] = draft_size({size_.width, size_.height});
            size_ = {width, height};
        }
        if (size_.width <= legend_width() + 16 || size_.height < 16) refuse("--size: too small for a film.");
    }

    void make() {
        if (!options_.chunk.empty()) return make_chunk();
        const double start = now_seconds();
        const double rate = options_.frames_per_second.value_or(
            is_own_ && options_.frame == 0 && !options_.turntable ? subject_->poses.frames_per_second : 30);
        FilmWriter writer = require(FilmWriter::create(path_of(options_.output), size_.width, size_.height, rate));
        prepare();
        require(film_frames(
            frames_, [&](std::size_t frame, const RunContext& quiet) { return draw(frame, quiet); },
            std::span(&writer, 1), fmt::format("filming {} frames", frames_), context()));
        session_.begin_writing(options_.output);
        require(writer.finish());
        report(fmt::format("{}{} frames of ", options_.draft ? "a draft of " : "", frames_), size_, frames_,
               now_seconds() - start);
    }

private:
    unsigned legend_width() const { return has_scalars() ? unsigned(kLegendWidth) : 0; }
    Pose pose_at(std::size_t moment) const {
        if (!is_own_) return read_pose(*subject_, options_.poses[moment]);
        return subject_->poses.frames[options_.frame > 0 ? options_.frame - 1 : moment];
    }

    /// Some of the numbered pictures, of which other processes draw the rest.
    void make_chunk() {
        const double start = now_seconds();
        WorkChunk chunk = chunk_of(options_.chunk);
        chunk.job = job();
        const NumberedName name = *printf_numbered_name(path_of(options_.output));
        SharedItems pictures{.path = path_of(options_.output), .what = "pictures", .names = {}, .phase = "filming"};
        for (std::size_t frame = 0; frame < frames_; ++frame)
            pictures.names.push_back(name.file(frame + 1).filename().string());
        session_.begin_writing(options_.output);
        bool is_prepared = false;
        const auto picture = [&](std::size_t frame) -> Result<std::string> {
            if (!std::exchange(is_prepared, true)) prepare();
            const Result<Picture> drawn = draw(frame, session_.silent_context());
            if (!drawn) return drawn.error();
            return encode_png(*drawn);
        };
        const auto are_there = [&] {
            std::error_code failed;
            return std::ranges::all_of(pictures.names, [&](const std::string& name_of_one) {
                return std::filesystem::exists(name.folder / path_of(name_of_one), failed);
            });
        };
        const SharedItemsReport written = require(make_shared_items(
            pictures, chunk, picture, [&](const auto& file) { return place(pictures.names, name.folder, file); },
            are_there, context()));
        // Of a process that was killed while it placed the same: its pictures would come back with the next batch.
        if (written.is_whole) require(complete_batches(name.folder));
        report_chunk(options_.output, chunk, written, "pictures", now_seconds() - start, session_);
    }

    /// What the pictures are made of, as a line of text.
    std::string job() const {
        std::vector<std::filesystem::path> inputs;
        for (const std::string& file : options_.files) inputs.push_back(path_of(file));
        for (const std::string& poses : options_.poses) inputs.push_back(path_of(poses));
        if (!options_.against.empty()) inputs.push_back(path_of(options_.against));
        const std::string settings = session_.settings_but(
            {"files", "--poses", "--against", "--output", "--chunk", "--threads", "--quiet", "--json"});
        return require(hash_of_files(inputs)) + " " + hash_of_bytes(settings);
    }

    /// All of them or none; they stay where they are, too.
    static Status place(const std::vector<std::string>& pictures, const std::filesystem::path& folder,
                        const std::function<std::filesystem::path(std::size_t)>& file) {
        Result<FileBatch> batch = FileBatch::create(folder);
        if (!batch) return batch.error();
        for (std::size_t k = 0; k < pictures.size(); ++k) {
            if (Status free = batch->check_place(pictures[k]); !free) return free;
            if (const int failed = platform::link(file(k), batch->path(pictures[k])))
                return cannot_write(folder / path_of(pictures[k]), failed);
        }
        return batch->finish();
    }

    void prepare() {
        look_ahead();
        show_first();
        choose_camera();
        shown_ = by_pose_ ? moments_ : 0;
    }

    /// A first look at every moment, for a camera, a ground and a range of colours that hold for the whole film.
    void look_ahead() {
        std::vector<float> values;
        std::vector<Vec3f> room;
        for (std::size_t m = 0; m < moments_; ++m) {
            if (context().is_cancelled()) throw Failure{cancelled_error()};
            context().report("looking ahead", double(m) / double(moments_));
            if (by_file_ && m > 0) subject_ = read(options_.files[m]);
            if (by_pose_) set_pose(*subject_, pose_at(m), false);
            extent_.add(shown_points(*subject_, room).positions, subject_->mesh.origin);
            const std::size_t stride = 1 + subject_->mesh.vertex_count() / 20'000;
            for (std::size_t v = 0; v < subject_->scalars.size(); v += stride) values.push_back(subject_->scalars[v]);
        }
        range_ = range_of(values);
        clip_box_ = extent_.box();
    }

    void show_first() {
        if (by_file_ && moments_ > 1) subject_ = read(options_.files[0]);
        if (by_pose_) set_pose(*subject_, pose_at(0), false);
        upload(*subject_);
        film_radius_ = subject_->drawable->point_radius();
        extent_.widen(film_radius_);
    }

    void choose_camera() {
        const double aspect = double(size_.width - legend_width()) / size_.height;
        std::vector<Vec3f> ring;
        const CameraPoints points = options_.turntable ? extent_.points_turning(up_, ring) : extent_.points();
        camera_ = camera_for(std::span(&points, 1), aspect);
        if (!options_.turntable || !options_.camera.empty()) return;
        // Turn about the object's middle, whatever point the fitted camera looks at.
        const Vec3d up = up_vector(up_), off = camera_.target - extent_.box().centre();
        camera_.target -= off - off.dot(up) * up;
        camera_.eye -= off - off.dot(up) * up;
    }

    void show(std::size_t moment) {
        if (moment == shown_) return;
        if (by_file_) {
            subject_ = read(options_.files[moment]);
            triangles_ = points_ = 0;
            upload(*subject_);
        }
        if (by_pose_) set_pose(*subject_, pose_at(moment), true);
        shown_ = moment;
    }

    Result<Picture> draw(std::size_t frame, const RunContext& quiet) {
        show(frame * moments_ / frames_);
        Scene scene = scene_of(*subject_);
        scene.fixed_ground = true;
        scene.ground_level = extent_.ground_level(up_);
        const Camera seen = options_.turntable ? turned(camera_, 360.0 * double(frame) / double(frames_)) : camera_;
        PictureOptions picture = picture_options(size_.width - legend_width(), size_.height);
        if (!picture.passes) picture.passes = options_.draft ? kDraftPasses : 12;
        Result<Picture> drawn = renderer_.picture(scene, seen, picture, quiet);
        if (!drawn || !has_scalars()) return drawn;
        Page page(size_.width, size_.height);
        page.picture(*drawn, {0, 0}, picture.width, picture.height);
        page.legend(options_.map, range_, Page::plain(subject_->scalar_title), {size_.width - kLegendWidth + 14, 24},
                    std::min(420.0, size_.height - 60.0));
        return page.pixels(1);
    }

    bool by_file_, is_own_ = false, by_pose_ = false;
    std::unique_ptr<Subject> subject_;
    std::size_t moments_ = 1, frames_ = 1;
    PictureSize size_{960, 720};
    FilmExtent extent_;
    Camera camera_;
    std::size_t shown_ = 0; ///< the moment that is uploaded; moments_: none
};

} // namespace

void render_film(const RenderOptions& options, Session& session) { RenderedFilm(options, session).make(); }

} // namespace filigree::cli
