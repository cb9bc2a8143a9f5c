#include "expected_error.h"

#include "words.h"
#include "workbench.h"

#include "filigree/present/error_picture.h"

#include <algorithm>

namespace filigree::studio {

namespace {

using Clock = std::chrono::steady_clock;

const std::string kTopic = "expected error";
constexpr std::chrono::milliseconds kLeastPause(150); // between two looks: as fast as one reads numbers
constexpr int kPauses = 4;                            // so many times as long as a look took

bool is_judged(const State& state) { return state.model != nullptr; }

} // namespace

/// What every pose of a model is judged with. Of one job at a time.
struct ExpectedError::Judge {
    std::shared_ptr<const Model> model;
    Restorer restorer;
    PoseError error;
};

struct ExpectedError::Judgement {
    std::shared_ptr<Judge> judge;
    PoseError::Estimate estimate;
    HeatMap colors;
    Clock::duration took;
};

ExpectedError::ExpectedError(Workbench& workbench) : workbench_(workbench) {
    pause_.setSingleShot(true);
    connect(&pause_, &QTimer::timeout, this, &ExpectedError::look_soon);
    connect(&jobs_, &Jobs::finished, this, &ExpectedError::look_soon);
    connect(&workbench, &Workbench::pose_changed, this, &ExpectedError::follow);
}

QString ExpectedError::warning() const {
    if (!estimate_ || !estimate_->is_too_curved()) return {};
    const auto& recording = workbench_.state().recording;
    if (workbench_.mode() == Mode::body && recording && recording->fitted) return {}; // that was measured
    return QStringLiteral("The pose is more curved than the driver can follow: the mesh is off by about %1 % of the "
                          "diagonal. Choose a larger driver (Detail, Size).")
        .arg(number_text(100 * estimate_->share(), 2));
}

void ExpectedError::want_colors(bool wanted) {
    if (wants_colors_ == wanted) return;
    wants_colors_ = wanted;
    if (wanted) follow();
}

void ExpectedError::follow() {
    const State& state = workbench_.state();
    const bool is_at_rest = !workbench_.pose();
    ++wanted_;
    if (state.model != model_ || is_at_rest || !is_judged(state)) {
        jobs_.drop(kTopic);
        model_ = state.model;
        if (is_at_rest && is_judged(state)) {
            PoseError::Estimate none;
            none.local.resize(model_->driver().vertices.size());
            put(none, wants_colors_ ? expected_error_map(*model_, none) : HeatMap());
        } else {
            put({}, {});
        }
    }
    if (is_at_rest || !is_judged(state)) judged_ = wanted_;
    look_soon();
}

void ExpectedError::put(std::optional<PoseError::Estimate> estimate, HeatMap colors) {
    if (!estimate && !estimate_ && colors_.values.empty()) return;
    estimate_ = std::move(estimate);
    colors_ = std::move(colors);
    ++number_;
    Q_EMIT changed();
}

void ExpectedError::look_soon() {
    if (!is_pending() || jobs_.is_busy() || pause_.isActive()) return;
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_look_ - Clock::now());
    if (wait.count() > 0) return pause_.start(wait);
    look();
}

void ExpectedError::look() {
    jobs_.start<Judgement>(
        "The expected error", kTopic,
        [judge = judge_, model = model_, pose = *workbench_.pose(),
         with_colors = wants_colors_](const RunContext& cancels) mutable -> Result<Judgement> {
            const auto begin = Clock::now();
            const RunContext context(1); // the others are for what moves
            if (!judge || judge->model != model) {
                // Gradients are the driver's alone.
                Result<Restorer> restorer = Restorer::create(*model, {.level = 0}, context);
                if (!restorer) return restorer.error();
                judge.reset(new Judge{model, std::move(*restorer), PoseError(*model, context)});
            }
            if (cancels.is_cancelled()) return cancelled_error();
            const Result<std::vector<Mat3f>> gradients = judge->restorer.gradients(pose, context);
            if (!gradients) return gradients.error();
            Result<PoseError::Estimate> estimate = judge->error.estimate(pose, *gradients);
            if (!estimate) return estimate.error();
            Judgement made{judge, std::move(*estimate), {}, {}};
            if (with_colors) made.colors = expected_error_map(*model, made.estimate);
            made.took = Clock::now() - begin;
            return made;
        },
        [this, number = wanted_](Judgement made) {
            judge_ = std::move(made.judge);
            judged_ = number;
            next_look_ = Clock::now() + std::max<Clock::duration>(kLeastPause, kPauses * made.took);
            put(std::move(made.estimate), std::move(made.colors));
        },
        {.failed = [this, number = wanted_](const Error&) { // the shape is not there then either, and that is told
            judged_ = number;
            put({}, {});
        }});
}

} // namespace filigree::studio
