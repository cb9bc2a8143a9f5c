"""The Python reference: a page whose entries Sphinx takes from the module's docstrings."""

# What stands together, in the order of a first use; everything public of the module is in one of these.
AREAS = {
    "Meshes": ["Mesh", "make", "read_mesh", "write_mesh", "info"],
    "Strip and restore": ["strip", "Model", "read_model", "write_model", "pack", "Restorer", "restore", "expected_error"],
    "Poses": ["Pose", "PoseSequence", "read_poses", "Warp", "stretch", "squeeze", "bend", "twist", "taper", "smooth_random", "rbf", "chain", "Warped", "rest_pose", "fit", "Fitted"],
    "Handles": ["HandleSolver", "HandleRegion", "move_by_handles", "read_handles"],
    "Comparing": ["compare", "vertex_distances", "distances_to_surface", "edge_strains"],
    "Surfaces": ["closest_points", "ClosestPoints", "signed_distance", "winding_numbers", "normals", "face_normals", "areas", "volume", "edges", "boundary", "adjacency", "split", "concatenate"],
    "Matrices and derivatives": ["SparseMatrix", "Bindings", "GradientOperator", "PoseDerivative"],
    "Points inside": ["contains", "InsideTest", "sample"],
    "Quads and pieces": ["remesh", "Remeshed", "fracture", "FracturedMesh"],
    "The report's method": ["strip_reference", "ReferenceModel"],
    "Bodies": ["Body", "Material", "materials", "Simulation", "Attachment", "Actor", "Obstacle", "Pin", "Force", "Hand", "HeatSource", "RigidMotion", "Momentum", "SceneRun"],
    "Flesh": ["read_skin", "Skin", "Flesh", "target_velocities"],
    "Writing for other programs": ["export", "write_animation"],
    "Pictures": ["render", "read_picture", "write_picture", "plot", "View"],
    "Errors": ["Error", "UsageError", "NotFoundError", "BadFileError", "UnsupportedError", "UnwritableError", "UnsuitableError", "MismatchError", "OutOfMemoryError", "Cancelled", "FiligreeWarning"],
}


def write(folder):
    import filigree

    listed = {name for names in AREAS.values() for name in names}
    public = {name for name in filigree.__all__ if not name.startswith("_")}
    if public != listed:
        raise SystemExit(f"python_reference.py: the module and AREAS differ: {sorted(public ^ listed)}")
    lines = ["Python", "======", "", "The module ``filigree``. :doc:`The guide <../python>` says how arrays, long calls and errors work.", ""]
    for area, names in AREAS.items():
        lines += [area, "-" * len(area), ""]
        for name in names:
            if isinstance(getattr(filigree, name), type):
                lines += [f".. autoclass:: filigree.{name}", "   :members:", ""]
            else:
                lines += [f".. autofunction:: filigree.{name}", ""]
    (folder / "python.rst").write_text("\n".join(lines))
