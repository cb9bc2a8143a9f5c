#include "panels/panels.h"

#include "actions.h"
#include "panel.h"

#include <QSignalBlocker>
#include <QSlider>

namespace filigree::studio {
namespace {

class Timeline : public QWidget {
public:
    Timeline(Workbench& workbench, const Actions& actions, QWidget* parent)
        : QWidget(parent), workbench_(workbench), scrub_(new QSlider(Qt::Horizontal, this)),
          frame_(new Text("timeline.frame", Tone::plain, this)) {
        setObjectName("timeline");
        auto* row = new QHBoxLayout(this);
        row->setContentsMargins(8, 4, 8, 4);
        row->setSpacing(4);
        row->addWidget(icon_button("timeline.reset", actions.find("body.reset"), this));
        row->addWidget(
            play_button("timeline.play", workbench, actions.find("body.play"), actions.find("body.pause"), this));
        row->addWidget(icon_button("timeline.step", actions.find("body.step"), this));
        row->addSpacing(6);
        scrub_->setObjectName("timeline.scrub");
        scrub_->setToolTip("The frame shown of the recording");
        scrub_->setAccessibleName("Frame");
        scrub_->setFocusPolicy(Qt::StrongFocus);
        row->addWidget(scrub_, 1);
        row->addSpacing(6);
        frame_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
        frame_->setToolTip("The frame shown, of how many, and its time in seconds");
        row->addWidget(frame_);
        row->addSpacing(6);
        film_ = new ActionButton("timeline.film", actions.find("file.export_film"), "Film…", this);
        meshes_ = new ActionButton("timeline.meshes", actions.find("file.export_meshes"), "Meshes…", this);
        row->addWidget(film_);
        row->addWidget(meshes_);
        be_narrow(false);
        whole_width_ = row->totalMinimumSize().width();
        be_narrow(true);
        narrow_width_ = row->totalMinimumSize().width();

        connect(scrub_, &QSlider::valueChanged, this,
                [this](int frame) { workbench_.go_to_frame(std::size_t(frame)); });
        connect(&workbench_, &Workbench::timeline_changed, this, &Timeline::refresh);
        connect(&workbench_.document(), &Document::changed, this, &Timeline::refresh);
        connect(&workbench_, &Workbench::mode_changed, this, &Timeline::refresh);
        refresh();
    }

    QSize minimumSizeHint() const override { // of the narrow form
        return {narrow_width_, QWidget::minimumSizeHint().height()};
    }

private:
    void resizeEvent(QResizeEvent* event) override {
        QWidget::resizeEvent(event);
        if (const bool narrow = width() < whole_width_; narrow != is_narrow_) {
            be_narrow(narrow);
            refresh();
        }
    }

    void be_narrow(bool narrow) {
        is_narrow_ = narrow;
        film_->set_icon_alone(narrow);
        meshes_->set_icon_alone(narrow);
        frame_->setMinimumWidth(
            fontMetrics().horizontalAdvance(narrow ? "9,999 of 9,999" : "frame 9,999 of 9,999 · 99.99 s"));
    }

    void refresh() {
        const std::size_t count = workbench_.frame_count(), frame = workbench_.frame();
        {
            const QSignalBlocker quiet(scrub_);
            scrub_->setRange(0, count > 0 ? int(count - 1) : 0);
            if (!scrub_->isSliderDown()) scrub_->setValue(int(frame));
        }
        scrub_->setEnabled(count > 1);
        frame_->set_tone(count == 0 ? Tone::quiet : Tone::plain);
        if (count == 0) return frame_->setText("no recording");
        const QString place = QStringLiteral("%1 of %2").arg(with_commas(frame), with_commas(count - 1));
        frame_->setText(is_narrow_ ? place
                                   : QStringLiteral("frame %1 · %2 s")
                                         .arg(place)
                                         .arg(double(frame) / workbench_.frames_per_second(), 0, 'f', 2));
    }

    Workbench& workbench_;
    QSlider* scrub_;
    Text* frame_;
    ActionButton *film_, *meshes_;
    bool is_narrow_ = true;
    int narrow_width_ = 0, whole_width_ = 0;
};

} // namespace

QWidget* make_timeline(Workbench& workbench, const Actions& actions, QWidget* parent) {
    return new Timeline(workbench, actions, parent);
}

} // namespace filigree::studio
