#include "chunks.h"
#include "commands.h"
#include "draft.h"
#include "rendering.h"

#include "filigree/io/system/numbered_name.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

PictureSize parse_picture_size(const std::string& text) {
    PictureSize size;
    const char* end = text.data() + text.size();
    const auto [x, first] = std::from_chars(text.data(), end, size.width);
    if (first == std::errc() && x < end && *x == 'x') {
        const auto [rest, second] = std::from_chars(x + 1, end, size.height);
        if (second == std::errc() && rest == end && size.width > 0 && size.height > 0) return size;
    }
    refuse("--size: '" + text + "' is no size; write width and height in pixels, such as 1920x1080.");
}

/// "z=0.5": what is above the middle along z is cut away; "-z=0.5": what is below.
ClipOption parse_clip(const std::string& text) {
    ClipOption clip;
    std::string_view rest = text;
    clip.keeps_far_side = rest.starts_with('-');
    if (clip.keeps_far_side) rest.remove_prefix(1);
    const std::size_t axis = rest.empty() ? std::string::npos : std::string_view("xyz").find(rest[0]);
    if (axis != std::string::npos && rest.size() > 2 && rest[1] == '=') {
        clip.axis = static_cast<int>(axis);
        const auto [end, error] = std::from_chars(rest.data() + 2, rest.data() + rest.size(), clip.fraction);
        if (error == std::errc() && end == rest.data() + rest.size() && std::isfinite(clip.fraction)) return clip;
    }
    refuse("--clip: '" + text +
           "' is no clip plane; write z=0.5 to cut away what is above the middle along z, -z=0.5 "
           "for what is below.");
}

void check(const RenderOptions& options, bool is_film) {
    if (!is_film) check_picture_path(options.output);
    if (!options.camera.empty() && options.camera.size() != 6 && options.camera.size() != 9)
        refuse("--camera takes 6 numbers (eye and target) or 9 (and the direction that is up).");
    if (!options.range.empty() && !(options.range[0] < options.range[1]))
        refuse("--range: the first number has to be below the second.");
    if (options.captions.size() > options.files.size())
        refuse(fmt::format("There are {} captions for {} files.", options.captions.size(), options.files.size()));
    if (is_film && !options.captions.empty()) refuse("A film has no captions; leave --caption out.");
    if (!options.against.empty() && options.scalar != "error" && options.scalar != "strain")
        refuse("--against is what --scalar error and --scalar strain are measured against; say which.");
    if (options.scalar.empty() && (!options.range.empty() || !options.unit.empty()))
        refuse("--range and --unit belong to --scalar; say which numbers to show.");
    if (options.shared_camera && !options.poses.empty()) refuse("--shared-camera is for several files; leave it out.");
    if (is_film && (std::count(options.files.begin(), options.files.end(), "-") ||
                    std::count(options.poses.begin(), options.poses.end(), "-")))
        refuse("A film reads its files twice, and standard input can be read once; give file names.");
    const bool has_page = is_film ? !options.scalar.empty()
                                  : !options.scalar.empty() || !options.captions.empty() || options.files.size() > 1 ||
                                        lower_extension(path_of(options.output)) != ".png";
    if (options.as == DrawnAs::surfels &&
        (options.points || options.edges || options.wireframe || options.restore.level))
        refuse("--as surfels draws neither points nor edges nor levels; leave --points, --edges, --wireframe and "
               "--level out.");
    if (options.background == "transparent" && has_page)
        refuse("--background transparent is for one picture in a .png without captions and legend; a page is white.");
    if (!options.chunk.empty() && !printf_numbered_name(path_of(options.output)))
        refuse("--chunk is of numbered pictures; let -o be a name such as frame_%04d.png.");
    if (!options.chunk.empty()) (void)chunk_of(options.chunk);
    if (options.turntable && !is_film)
        refuse("--turntable makes a film; give -o a name that ends in .mp4 or .gif, or frame_%04d.png.");
    if (!options.poses.empty() && options.frame > 0) refuse("--poses and --frame both pose the model; give one.");
    if (options.frame > 0 && is_film && !options.turntable)
        refuse("--frame is one moment; let -o end in .png, or add --turntable.");
    if (!options.poses.empty() && options.files.size() != 1) refuse("--poses move one model; give one model file.");
    if (!is_film && options.poses.size() > 1)
        refuse("Several poses make a film; give -o a name that ends in .mp4 or .gif, or frame_%04d.png.");
    if ((!options.poses.empty() || options.frame > 0) && !options.scalar.empty() && options.scalar != "level")
        refuse(kPosesWithoutScalars);
}

OptionList camera_options(RenderOptions& options) {
    return {Option("--size",
                   Option::EachText([&](const std::string& text) { options.size = parse_picture_size(text); }),
                   "Width and height in pixels, such as 1920x1080 (default: by the content)"),
            view_option(options.view, "View direction (default: iso)"),
            found_up_option(options.up),
            Option("--camera", options.camera,
                   "Camera position, target and (optional) up direction: 6 or 9 numbers, model units")
                .finite()
                .values(6, 9)
                .comma_separated(),
            Option("--field-of-view", options.field_of_view, "Vertical field of view, degrees; 0: parallel projection")
                .between(0.0, 150.0)
                .with_default(),
            Option("--shared-camera", options.shared_camera,
                   "Several files: one camera for all, each mesh in its own place")};
}

OptionList look_options(RenderOptions& options) {
    return {
        Option("--background", options.background,
               "Background: #rrggbb, a gradient from top to bottom (#rrggbb,#rrggbb), or transparent"),
        Option("--color", options.color, "Colour of the objects, #rrggbb (default: their own colours, or clay)"),
        choice<Shading>("--shading", options.shading,
                        {{"auto", Shading::automatic}, {"smooth", Shading::smooth}, {"flat", Shading::flat}},
                        "auto (default): the file's normals; without normals, smooth up to 45 degrees"),
        Option("--edges", options.edges, "Draw the polygons' edges over the surface"),
        Option("--edge-color", options.edge_color, "Colour of the edges, #rrggbb"),
        Option("--wireframe", options.wireframe, "Draw only the edges"),
        choice<DrawnAs>("--as", options.as, {{"polygons", DrawnAs::polygons}, {"surfels", DrawnAs::surfels}},
                        "polygons (default), or surfels: overlapping discs, from the file or made from the surface"),
        Option("--points", options.points, "Draw the vertices as balls"),
        Option("--point-radius", options.point_radius, "Radius of the balls, model units (default: by their spacing)")
            .above_zero(),
        Option("--clip", Option::EachText([&](const std::string& text) { options.clip = parse_clip(text); }),
               "Cut open: z=0.5 removes the upper half along z, -z=0.5 the lower half")};
}

OptionList scalar_options(RenderOptions& options) {
    return {Option("--scalar", options.scalar,
                   "Colour by values: a vertex scalar of the file, level, or (with --against) error or strain"),
            Option("--against", options.against, "Mesh to compare with, for error and strain").is_read(),
            Option("--range", options.range, "Smallest and largest value of the colours (default: from the data)")
                .finite()
                .values(2),
            Option("--unit", options.unit,
                   "Unit shown in the legend. Errors are then in model units, else fractions of the diagonal"),
            choice<ColorMap>("--map", options.map,
                             {{"sequential", ColorMap::sequential}, {"diverging", ColorMap::diverging}},
                             "Colour map: sequential for amounts (default), diverging for signed amounts")};
}

OptionList page_options(RenderOptions& options) {
    return {Option("--caption", options.captions,
                   "Caption of a file; once per file (default: the file names, if there are several). C_m, 10^{-3}, "
                   "*italic* and **bold** are formatted")
                .one_at_a_time(), // else it would take the files behind it
            Option("--no-captions", options.no_captions, "Draw no captions"),
            Option("--no-ground", options.no_ground, "Draw no shadow on the ground")};
}

OptionList film_options(RenderOptions& options) {
    return {
        Option("--poses", options.poses,
               "Motion of a model's driver: one mesh per frame (PLY may have gradients), or one .pc2, .mdd, animated "
               "glTF, pose_####.ply or model with poses")
            .is_read(),
        Option("--turntable", options.turntable, "Make a film that goes once around the object"),
        Option("--frames", options.frames, "Number of frames of a turntable").whole_from(1).with_default(),
        Option("--chunk", options.chunk,
               "K/N: draw only the K-th of N parts of the frames, as numbered pictures; other processes draw the other "
               "parts"),
        Option("--frame", options.frame,
               "Draw pose N that the model holds, from 1 (default: a film plays all poses, a picture shows the model "
               "at rest)")
            .whole_from(1),
        Option("--draft", options.draft, kDraftHelp),
        Option("--fps", options.frames_per_second, "Frames per second (default: the rate of the model's poses, or 30)")
            .above_zero(),
        Option("--passes", options.passes,
               "Number of passes that are averaged; more passes give softer light and smoother edges (default: 12 to "
               "40 by the size of the mesh; films 12)")
            .whole_from(1)};
}

/// Whether one file holds a motion, not a moment.
bool is_motion(const std::string& path) {
    const std::string ending = lower_extension(path_of(path));
    return path.find('#') != std::string::npos || ending == ".pc2" || ending == ".mdd" || ending == ".glb" ||
           ending == ".gltf" || ending == ".fil";
}

void run(RenderOptions options, Session& session) {
    const bool is_film = is_film_path(path_of(options.output));
    if (options.draft && !is_film) refuse("--draft is of films; let -o end in .mp4, .gif or _%04d.png.");
    if (options.poses.size() == 1 && is_motion(options.poses[0])) {
        if (options.files.size() != 1) refuse("--poses move one model; give one model file.");
        options.motion = options.poses[0];
        options.poses.clear();
        if (!is_film && options.frame == 0)
            refuse(options.motion + ": is a motion, and a picture shows one moment of it; say which with --frame, or "
                                    "give -o a film's name.");
    }
    check(options, is_film);
    is_film ? render_film(options, session) : render_still(options, session);
}

} // namespace

Command render_command() {
    const auto options = std::make_shared<RenderOptions>();
    return {.name = "render",
            .text = "Draw meshes, point sets and models: a picture or a film",
            .options = OptionList{Option("files", options->files,
                                         "Meshes, point sets or models; give them before the options. A picture shows "
                                         "several side by side, a film one after the other")
                                      .is_read()
                                      .required(),
                                  output_option(options->output,
                                                "Picture (.png, .svg, .pdf) or film (.mp4, .gif, frame_%04d.png)")} +
                       camera_options(*options) + look_options(*options) + scalar_options(*options) +
                       page_options(*options) + film_options(*options) + restore_options(options->restore),
            .examples = "  filigree render scan.ply -o scan.png\n"
                        "  filigree render scan.fil --level 0 --edges -o driver.png --view front --size 1920x1080\n"
                        "  filigree render a.ply b.ply -o both.png --caption before --caption after\n"
                        "  filigree render restored.ply --scalar error --against full.ply -o error.png\n"
                        "  filigree render scan.fil --poses pose_*.ply -o film.mp4\n"
                        "  filigree render bounce.fil -o bounce.mp4\n"
                        "  filigree render bounce.fil --frame 30 -o half_a_second.png\n"
                        "  filigree render scan.ply -o around.gif --turntable --size 480x480",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
