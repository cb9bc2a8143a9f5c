// The picture in the middle: draws the document, turns with the mouse, and lets the mouse pull it.
#pragma once

#include "pointer.h"

#include <QOpenGLWidget>

namespace filigree::studio {

/// What the last pictures took and showed, for the status bar.
struct Timings {
    double driver = 0, restore = 0, draw = 0; ///< milliseconds; restore: 0 where the vertex shader does it
    double frames_per_second = 0;             ///< drawn, while things move
    std::size_t vertices = 0, triangles = 0;  ///< of the mesh as drawn
    unsigned level = 0;                       ///< drawn; may be coarser than the document's
    double part = 1;                          ///< of the level that is drawn, while another melts into it
    std::string renderer;                     ///< what OpenGL calls itself
};

class Viewport : public QOpenGLWidget {
    Q_OBJECT
public:
    explicit Viewport(Workbench& workbench, QWidget* parent = nullptr);
    ~Viewport() override;

    const Timings& timings() const;
    /// Looks from a direction and shows all; with the animation off at once.
    void look_from(View view);
    void show_all();
    /// What is to be shown is there, and drawn at least once (or there is trouble).
    bool is_ready() const;
    /// Draws all passes at once: for screenshots. Blocks.
    void finish_drawing();
    /// The sentence shown instead of a picture; "" when all is well.
    const std::string& trouble() const;
    /// What of the surface is under a point of the widget (device-independent pixels); none beside.
    std::optional<Picked> pick(const QPointF& point);
    /// Where a point of the world is on the widget (device-independent pixels), in the tile of the restored mesh.
    QPointF place_of(const Vec3d& world) const;
    /// Whether the camera goes where it is told on a short way, or at once. By default as the style animates.
    void set_animated(bool animated);
    /// How many passes a still picture is the sum of; 0, as by default, for as many as suit its size.
    void set_passes(unsigned passes);
    /// Something else lies over so much of the top, pixels: what is written there begins below it.
    void set_covered(int height);
    /// Whether nothing is prepared, moves or waits to be drawn: the picture is what finish_drawing() would give.
    bool is_still() const;

Q_SIGNALS:
    void timings_changed();

protected:
    void initializeGL() override;
    void paintGL() override;
    void resizeGL(int width, int height) override;
    void mousePressEvent(QMouseEvent* event) override;
    void mouseMoveEvent(QMouseEvent* event) override;
    void mouseReleaseEvent(QMouseEvent* event) override;
    void mouseDoubleClickEvent(QMouseEvent* event) override;
    void wheelEvent(QWheelEvent* event) override;
    void leaveEvent(QEvent* event) override;
    void keyPressEvent(QKeyEvent* event) override; ///< Esc puts back what is being pulled
    void showEvent(QShowEvent* event) override;
    void changeEvent(QEvent* event) override;
    void resizeEvent(QResizeEvent* event) override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace filigree::studio
