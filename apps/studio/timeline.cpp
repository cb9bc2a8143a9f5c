#include "timeline.h"

#include <QSignalBlocker>

namespace filigree::studio {

Timeline::Timeline(Workbench& workbench, const Actions& actions, QWidget* parent)
    : QWidget(parent), workbench_(workbench), play_(actions.find("body.play")), pause_(actions.find("body.pause")),
      scrub_(new QSlider(Qt::Horizontal, this)), frame_(new Text("timeline.frame", Tone::plain, this)) {
    setObjectName("timeline");
    auto* row = new QHBoxLayout(this);
    row->setContentsMargins(8, 4, 8, 4);
    row->setSpacing(4);
    row->addWidget(icon_button("timeline.reset", actions.find("body.reset"), this));
    play_button_ = icon_button("timeline.play", play_, this);
    row->addWidget(play_button_);
    row->addWidget(icon_button("timeline.step", actions.find("body.step"), this));
    row->addSpacing(6);
    scrub_->setObjectName("timeline.scrub");
    scrub_->setToolTip("The frame shown of the recording");
    scrub_->setAccessibleName("Frame");
    scrub_->setFocusPolicy(Qt::StrongFocus);
    row->addWidget(scrub_, 1);
    row->addSpacing(6);
    frame_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
    frame_->setMinimumWidth(fontMetrics().horizontalAdvance("frame 9,999 of 9,999 · 99.99 s"));
    frame_->setToolTip("The frame shown, of how many, and its time in seconds");
    row->addWidget(frame_);
    row->addSpacing(6);
    row->addWidget(new ActionButton("timeline.film", actions.find("file.export_film"), "Film…", this));
    row->addWidget(new ActionButton("timeline.meshes", actions.find("file.export_meshes"), "Meshes…", this));

    connect(scrub_, &QSlider::valueChanged, this, [this](int frame) { workbench_.go_to_frame(std::size_t(frame)); });
    connect(&workbench_, &Workbench::timeline_changed, this, &Timeline::refresh);
    connect(&workbench_.document(), &Document::changed, this, &Timeline::refresh);
    connect(&workbench_, &Workbench::mode_changed, this, &Timeline::refresh);
    refresh();
}

void Timeline::refresh() {
    QAction* const shown = workbench_.is_playing() ? pause_ : play_;
    if (play_button_->defaultAction() != shown) {
        play_button_->removeAction(play_button_->defaultAction());
        play_button_->setDefaultAction(shown);
    }
    const std::size_t count = workbench_.frame_count(), frame = workbench_.frame();
    {
        const QSignalBlocker quiet(scrub_);
        scrub_->setRange(0, count > 0 ? int(count - 1) : 0);
        if (!scrub_->isSliderDown()) scrub_->setValue(int(frame));
    }
    scrub_->setEnabled(count > 1);
    if (count == 0) {
        frame_->setText("no recording");
        frame_->set_tone(Tone::quiet);
        return;
    }
    const auto& recording = workbench_.state().recording;
    const double rate = workbench_.playback().has_body() ? workbench_.playback().recording().frames_per_second
                        : recording                      ? recording->frames_per_second
                                                         : 60;
    frame_->set_tone(Tone::plain);
    frame_->setText(QStringLiteral("frame %1 of %2 · %3 s")
                        .arg(count_text(frame), count_text(count - 1))
                        .arg(double(frame) / rate, 0, 'f', 2));
}

} // namespace filigree::studio
