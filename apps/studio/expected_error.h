// How far the shape shown is expected to be from its full deformation: judged from the pose alone, while it moves too.
#pragma once

#include "document.h"
#include "jobs.h"

#include "filigree/render.h"
#include "filigree/restore.h"

#include <QTimer>

#include <chrono>

namespace filigree::studio {

class Workbench;

/// Follows the workbench's pose in a thread of its own: one pose at a time, always the newest. While things move it
/// takes at most a fifth of one processor. The last pose is always judged. Lives in the main thread.
class ExpectedError : public QObject {
    Q_OBJECT
public:
    explicit ExpectedError(Workbench& workbench);

    /// Of the pose shown, or while things move of one just before. Null: not judged yet, or no blend model.
    const PoseError::Estimate* estimate() const { return estimate_ ? &*estimate_ : nullptr; }
    /// One sentence where the pose is more curved than the driver can follow, with what to do; "" where it is not.
    QString warning() const;

    /// Whether colours are found as well. Cost O(V) a pose, in the other thread.
    void want_colors(bool wanted);
    /// One value a vertex of the finest mesh, fractions of the posed driver's diagonal; none: not known.
    const HeatMap& colors() const { return colors_; }
    std::uint64_t number() const { return number_; } ///< of what is known: another one with each changed()

    bool is_pending() const { return judged_ != wanted_; } ///< the pose shown is still to be judged

Q_SIGNALS:
    void changed();

private:
    struct Judge;
    struct Judgement;
    void follow();
    void look_soon();
    void look();
    void put(std::optional<PoseError::Estimate> estimate, HeatMap colors);

    Workbench& workbench_;
    std::shared_ptr<const Model> model_; ///< that the estimate is of
    std::optional<PoseError::Estimate> estimate_;
    HeatMap colors_;
    std::uint64_t wanted_ = 0, judged_ = 0; ///< poses
    std::uint64_t number_ = 0;
    bool wants_colors_ = false;
    std::shared_ptr<Judge> judge_;
    std::chrono::steady_clock::time_point next_look_;
    QTimer pause_;
    Jobs jobs_;
};

} // namespace filigree::studio
