#include "models.h"

namespace filigree::python {

namespace {

Pose make_pose(const py::handle& positions, const py::handle& gradients) {
    Pose pose{points_of(positions, "positions"), {}};
    if (!gradients.is_none()) pose.gradients = gradients_of(gradients, "gradients");
    if (!pose.gradients.empty() && pose.gradients.size() != pose.positions.size())
        refuse(ErrorCode::mismatch, "There are " + std::to_string(pose.positions.size()) + " positions and " +
                                        std::to_string(pose.gradients.size()) + " gradients.");
    return pose;
}

PoseSequence make_sequence(const py::object& frames, double frames_per_second, const py::object& gradients) {
    if (!(frames_per_second > 0)) refuse("frames_per_second has to be above 0.");
    PoseSequence sequence{frames_per_second, {}};
    const py::list each(frames), of_each(gradients.is_none() ? py::object(py::list()) : gradients);
    if (!gradients.is_none() && of_each.size() != each.size())
        refuse(ErrorCode::mismatch, "There are " + std::to_string(each.size()) + " frames and gradients for " +
                                        std::to_string(of_each.size()) + ".");
    for (std::size_t k = 0; k < each.size(); ++k)
        sequence.frames.push_back(
            pose_of(each[k], gradients.is_none() ? py::object(py::none()) : py::object(of_each[k])));
    return sequence;
}

py::object gradients_view(const py::object& self) {
    const Pose& pose = self.cast<const Pose&>();
    return pose.gradients.empty() ? py::object(py::none()) : view(pose.gradients, self);
}

py::tuple pose_state(const Pose& pose) {
    return py::make_tuple(take(std::vector(pose.positions)), take(std::vector(pose.gradients)));
}
Pose pose_of_state(const py::tuple& state) { return make_pose(state[0], state[1]); }

/// Frames are looked at and not copied: they keep the sequence.
py::object frame_of(const py::object& self, py::ssize_t frame) {
    const PoseSequence& poses = self.cast<const PoseSequence&>();
    const auto count = static_cast<py::ssize_t>(poses.frames.size());
    if (frame < 0) frame += count;
    if (frame < 0 || frame >= count) throw py::index_error("There are " + std::to_string(count) + " frames.");
    return py::cast(&poses.frames[static_cast<std::size_t>(frame)], py::return_value_policy::reference_internal, self);
}

PoseSequence frames_of(const PoseSequence& poses, const py::slice& slice) {
    py::ssize_t start = 0, stop = 0, step = 0, count = 0;
    if (!slice.compute(static_cast<py::ssize_t>(poses.frames.size()), &start, &stop, &step, &count))
        throw py::error_already_set();
    PoseSequence part{poses.frames_per_second, {}};
    for (py::ssize_t k = 0; k < count; ++k)
        part.frames.push_back(poses.frames[static_cast<std::size_t>(start + k * step)]);
    return part;
}

py::array_t<float> all_positions(const PoseSequence& poses) {
    const auto frames = static_cast<py::ssize_t>(poses.frames.size());
    const auto points = frames > 0 ? static_cast<py::ssize_t>(poses.frames[0].positions.size()) : 0;
    std::vector<Vec3f> all;
    all.reserve(static_cast<std::size_t>(frames * points));
    for (const Pose& pose : poses.frames) all.insert(all.end(), pose.positions.begin(), pose.positions.end());
    return take<float>(std::move(all), Shape{frames, points, 3});
}

} // namespace

Pose pose_of(const py::handle& pose, const py::handle& gradients) {
    if (!py::isinstance<Pose>(pose)) return make_pose(pose, gradients);
    if (!gradients.is_none()) refuse("A Pose holds its gradients; leave the others out, or give positions alone.");
    return pose.cast<const Pose&>();
}

PoseSequence poses_of(const py::handle& poses, double frames_per_second) {
    if (py::isinstance<PoseSequence>(poses)) return poses.cast<const PoseSequence&>();
    return make_sequence(py::reinterpret_borrow<py::object>(poses), frames_per_second, py::none());
}

void add_poses(py::module_& m) {
    py::class_<Pose>(m, "Pose",
                     R"(Where a driver is now, and how the space around each of its vertices is deformed.

Parameters
----------
positions : array_like, (d, 3)
    Of the driver's vertices, in its order, model units, relative to the mesh's `origin`.
gradients : array_like, (d, 3, 3), optional
    Deformation gradients, [vertex, row, column]: how a small vector at rest at that vertex has changed.

Raises
------
UsageError
    Numbers that are not finite, other shapes.
MismatchError
    Another number of gradients than of positions.

Examples
--------
>>> pose = filigree.Pose(numpy.zeros((5, 3)))
>>> pose.positions.dtype, pose.gradients
(dtype('float32'), None)
)")
        .def(py::init([](const py::object& positions, const py::object& gradients) {
                 return make_pose(positions, gradients);
             }),
             py::arg("positions"), py::arg("gradients") = py::none(),
             R"(__init__(self, positions, gradients=None)
--

)")
        .def_property_readonly(
            "positions", [](const py::object& self) { return view(self.cast<const Pose&>().positions, self); },
            "float32 (d, 3), read-only.")
        .def_property_readonly("gradients", &gradients_view, "float32 (d, 3, 3), read-only; None without.")
        .def("__len__", [](const Pose& pose) { return pose.positions.size(); })
        .def("__repr__",
             [](const Pose& pose) {
                 return "<filigree.Pose: " + std::to_string(pose.positions.size()) + " vertices" +
                        (pose.gradients.empty() ? "" : " with gradients") + ">";
             })
        .def(py::pickle(&pose_state, &pose_of_state));

    py::class_<PoseSequence>(m, "PoseSequence", R"(Poses of one driver, moment after moment.

Parameters
----------
frames : array_like, (f, d, 3), or sequence of Pose
    Positions frame by frame, relative to the mesh's `origin`.
frames_per_second : float
    Above 0.
gradients : array_like, (f, d, 3, 3), optional
    Where `frames` are positions.

Examples
--------
>>> poses = filigree.PoseSequence(numpy.zeros((24, 5, 3)), 24)
>>> len(poses), poses[-1]
(24, <filigree.Pose: 5 vertices>)
>>> poses[4:10]
<filigree.PoseSequence: 6 frames>
)")
        .def(py::init(&make_sequence), py::arg("frames"), py::arg("frames_per_second") = 60.0,
             py::arg("gradients") = py::none(),
             R"(__init__(self, frames, frames_per_second=60.0, gradients=None)
--

)")
        .def_property_readonly(
            "frames_per_second", [](const PoseSequence& poses) { return poses.frames_per_second; },
            "How fast it plays.")
        .def_property_readonly("positions", &all_positions, "All positions, a copy, float32 (f, d, 3).")
        .def("__len__", [](const PoseSequence& poses) { return poses.frames.size(); })
        .def("__getitem__", &frame_of, py::arg("frame"))
        .def("__getitem__", &frames_of, py::arg("frames"))
        .def("__repr__",
             [](const PoseSequence& poses) {
                 return "<filigree.PoseSequence: " + std::to_string(poses.frames.size()) + " frames>";
             })
        .def(py::pickle(
            [](const PoseSequence& poses) {
                py::list frames;
                for (const Pose& pose : poses.frames) frames.append(pose_state(pose));
                return py::make_tuple(poses.frames_per_second, frames);
            },
            [](const py::tuple& state) {
                PoseSequence poses{state[0].cast<double>(), {}};
                for (const py::handle frame : state[1]) poses.frames.push_back(pose_of_state(frame.cast<py::tuple>()));
                return poses;
            }));
}

} // namespace filigree::python
