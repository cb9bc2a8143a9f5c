// What the workbench keeps to itself, for the files it is written in.
#pragma once

#include "workbench.h"

#include <chrono>

#include <QTimer>

namespace filigree::studio {

/// The state with its source stripped by its options; the level shown stays the finest, or as fine as there is.
Result<State> stripped_state(State state, const RunContext& context);
Result<State> state_of_shape(State state, const Shape& shape, const RunContext& context);

double milliseconds_since(std::chrono::steady_clock::time_point begin);

// Topics of work.
inline const std::string kModelTopic = "model", kOpenTopic = "open", kBodyTopic = "body", kSourceTopic = "source",
                         kFitTopic = "fit";

struct Workbench::Impl {
    RunContext context;            ///< of what is done at once
    std::uint64_t pose_number = 0; ///< of the pose shown: what was measured of an older one is dropped

    // A pull: how to come back from the warped shape, and where it began, before the warp.
    std::unique_ptr<SpaceWarp> warp;
    Vec3d grabbed = Vec3d::Zero();
    Handle pull;

    // What make_shape() and set_strip() asked for last, while it is being made.
    std::optional<Shape> wanted_shape;
    StripOptions wanted_strip;

    QuadRemeshOptions quad_options;
    PieceOptions piece_options;
    GlbSettings glb_settings;
    FitSettings fit_settings;
    FleshSettings flesh_settings;
    /// The animation's mesh in the frame that is shown, made when it is first asked for.
    struct {
        std::shared_ptr<const MovingMesh> of;
        std::size_t frame = 0;
        std::shared_ptr<const Mesh> mesh;
    } original;
    double shown_apart = 0;      ///< how far pieces are apart in the pose shown
    bool shown_original = false; ///< as the view's settings said last

    QTimer replay;
    After then = After::nothing; ///< once the body is made
    std::size_t looked_at = 0;   ///< frame of the last moment of the body, shown or not
    bool told_of_rest = false;   ///< that a body is made of the shape at rest
    bool told_of_torch = false;  ///< that it does nothing here
    QString body_warning;
    std::optional<StripOptions> fits_driver; ///< once a model is made with these, a body is
    /// The document that the body there belongs to: it goes when model, body or recording become others.
    struct {
        std::shared_ptr<const Model> model;
        BodySettings settings;
        std::shared_ptr<const Recording> recording;
    } body_of;
    std::uint64_t measured_pose = 0; ///< whose error is measured once every vertex of it is delivered; 0: none
};

} // namespace filigree::studio
