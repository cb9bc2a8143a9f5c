"""How objects show themselves in notebooks: a picture where the renderer is there, numbers always, and views that turn."""

import base64
import html
import struct
import zlib
from pathlib import Path

import numpy

from . import _core
from ._matrices import numbers_of

_MOST_DRAWN = 200_000  # vertices of a mesh that is drawn unasked: a second

# One canvas, WebGL 2 without any library: drag turns, shift-drag moves, the wheel zooms.
_PAGE = """<!DOCTYPE html><meta charset="utf-8"><title>%(title)s</title>
<style>html,body{margin:0;height:100%%;background:#fff}canvas{width:100%%;height:100%%;display:block;touch-action:none}</style>
<canvas></canvas><script>
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const places = new Float32Array(bytes("%(places)s")), ids = new Uint32Array(bytes("%(triangles)s"));
const colors = new Uint8Array(bytes("%(colors)s"));
const canvas = document.querySelector("canvas");
const gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
if (!gl) document.body.textContent = "This browser has no WebGL 2, so that nothing can be shown.";
const part = (kind, text) => {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, "#version 300 es\\nprecision highp float;" + text);
  gl.compileShader(shader);
  gl.attachShader(program, shader);
};
const program = gl.createProgram();
part(gl.VERTEX_SHADER, `uniform vec4 turn; uniform vec3 shift; uniform vec2 lens; uniform float dot_size;
layout(location = 0) in vec3 place; layout(location = 1) in vec3 tint; out vec3 seen, color;
void main() {
  vec3 p = place + 2.0 * cross(turn.xyz, cross(turn.xyz, place) + turn.w * place) + shift;
  seen = p; color = tint; gl_PointSize = dot_size;
  gl_Position = vec4(lens * p.xy, -p.z * 1.002 - 0.02, -p.z);
}`);
part(gl.FRAGMENT_SHADER, `uniform float is_flat; in vec3 seen, color; out vec4 shade;
void main() {
  vec3 n = is_flat > 0.5 ? vec3(0, 0, 1) : normalize(cross(dFdx(seen), dFdy(seen)));
  float key = max(dot(n, normalize(vec3(-0.4, 0.6, 0.7))), 0.0), fill = max(dot(n, normalize(vec3(0.8, 0.0, 0.4))), 0.0);
  shade = vec4(pow(color * (0.22 + 0.75 * key + 0.18 * fill), vec3(1.0 / 2.2)), 1);
}`);
gl.linkProgram(program);
gl.useProgram(program);
const fill = (slot, data, size, type, whole) => {
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(slot);
  gl.vertexAttribPointer(slot, size, type, whole, 0, 0);
};
fill(0, places, 3, gl.FLOAT, false);
fill(1, colors, 3, gl.UNSIGNED_BYTE, true);
gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, ids, gl.STATIC_DRAW);
gl.enable(gl.DEPTH_TEST);
gl.clearColor(1, 1, 1, 1);
const at = name => gl.getUniformLocation(program, name);
let turn = %(turn)s, shift = [0, 0, -2.6];
const times = (a, b) => [
  a[3]*b[0] + a[0]*b[3] + a[1]*b[2] - a[2]*b[1], a[3]*b[1] - a[0]*b[2] + a[1]*b[3] + a[2]*b[0],
  a[3]*b[2] + a[0]*b[1] - a[1]*b[0] + a[2]*b[3], a[3]*b[3] - a[0]*b[0] - a[1]*b[1] - a[2]*b[2]];
const draw = () => {
  const scale = devicePixelRatio, w = canvas.clientWidth * scale, h = canvas.clientHeight * scale;
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  gl.viewport(0, 0, w, h);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.uniform4fv(at("turn"), turn);
  gl.uniform3fv(at("shift"), shift);
  const lens = 3.2 * Math.min(1, w / h);
  gl.uniform2f(at("lens"), lens * h / w, lens);
  gl.uniform1f(at("dot_size"), 4 * scale);
  gl.uniform1f(at("is_flat"), ids.length ? 0 : 1);
  if (ids.length) gl.drawElements(gl.TRIANGLES, ids.length, gl.UNSIGNED_INT, 0);
  else gl.drawArrays(gl.POINTS, 0, places.length / 3);
};
canvas.onpointerdown = event => canvas.setPointerCapture(event.pointerId);
canvas.onpointermove = event => {
  if (!event.buttons) return;
  const x = event.movementX / canvas.clientHeight, y = event.movementY / canvas.clientHeight;
  if (event.shiftKey || event.buttons & 6) { shift[0] -= x * shift[2] / 1.6; shift[1] += y * shift[2] / 1.6; }
  else {
    const angle = Math.hypot(x, y) * 3;
    if (angle) { const s = Math.sin(angle / 2) * 3 / angle; turn = times([y * s, x * s, 0, Math.cos(angle / 2)], turn); }
  }
  draw();
};
canvas.oncontextmenu = event => event.preventDefault();
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  shift[2] *= Math.exp(event.deltaY / 1000);
  draw();
}, {passive: false});
new ResizeObserver(draw).observe(canvas);
draw();
</script>
"""


def _text(data):
    return base64.b64encode(numpy.ascontiguousarray(data).tobytes()).decode()


def _colors_of(values):
    """Blue over white to red for numbers, as (n, 3) of 0 to 1 before gamma."""
    values = numpy.asarray(values, float)
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    at = (values - low) / (high - low) if high > low else numpy.full(values.shape, 0.5)
    ends = numpy.array([[0.02, 0.1, 0.45], [0.75, 0.75, 0.72], [0.6, 0.03, 0.03]])
    return numpy.stack([numpy.interp(at, [0, 0.5, 1], ends[:, k]) for k in range(3)], axis=-1)


class View:
    """A shape that turns under the mouse, in a notebook or as a page of its own; made by `plot`.

    Drag turns, shift-drag or the right button moves, the wheel zooms. Everything is in the page: 27 bytes a vertex and 16 a
    triangle.
    """

    def __init__(self, vertices, triangles, colors, title):
        self._page = _PAGE % {
            "title": html.escape(title),
            "places": _text(numpy.asarray(vertices, numpy.float32)),
            "triangles": _text(numpy.asarray(triangles, numpy.uint32)),
            "colors": _text((numpy.asarray(colors) * 255).round().astype(numpy.uint8)),
            "turn": "[0.2391, -0.3696, -0.0990, 0.8924]",
        }
        self._title = title

    def save(self, path):
        """Write the page to a file that a browser opens, and that needs nothing else."""
        Path(path).write_text(self._page)

    def _repr_html_(self):
        return (
            f'<iframe srcdoc="{html.escape(self._page)}" style="width:100%;height:420px;border:1px solid #ddd" '
            f'title="{html.escape(self._title)}"></iframe>'
        )

    def __repr__(self):
        return f"<filigree.View: {self._title}; save(path) writes a page>"


def plot(mesh, *, scalars=None, color=None, title=None):
    """Show a mesh, or points, so that it turns under the mouse: in a notebook by itself, else by `save`.

    Parameters
    ----------
    mesh : Mesh, Model, an object with vertices and faces, (V, F), or array_like (n, 3)
        z or y up as it is; flat shading.
    scalars : array_like, (n,), optional
        A number a vertex, shown from blue to red.
    color : array_like, (3,), optional
        sRGB, 0 to 1.
    title : str, optional
        Of the page.

    Returns
    -------
    View

    Examples
    --------
    >>> filigree.plot(filigree.make("torus"))
    <filigree.View: 8192 vertices; save(path) writes a page>
    """
    if isinstance(mesh, _core.Model):
        mesh = mesh.mesh
    try:
        mesh = _core._mesh_of(mesh)
    except TypeError:
        mesh = _core.Mesh(mesh)
    if scalars is not None:
        scalars = numbers_of(scalars, "scalars")
        if scalars.shape != (len(mesh.vertices),):
            raise _core.MismatchError(f"There are {scalars.size} scalars for {len(mesh.vertices)} vertices.")
        if not numpy.isfinite(scalars).all():
            raise _core.UsageError("scalars has numbers that are not finite.")
        colors = _colors_of(scalars)
    elif color is None and mesh.colors is not None:
        colors = mesh.colors[:, :3].astype(float) ** 2.2
    else:
        one = numbers_of((0.75, 0.62, 0.5) if color is None else color, "color")
        if one.shape != (3,) or not ((one >= 0) & (one <= 1)).all():
            raise _core.UsageError("color has to be three numbers from 0 to 1.")
        one **= 2.2
        colors = numpy.broadcast_to(one, (len(mesh.vertices), 3))
    places = mesh.vertices.astype(float)
    if len(places):
        low, high = places.min(axis=0), places.max(axis=0)
        places = (places - (low + high) / 2) / (numpy.linalg.norm(high - low) / 2 or 1)
    return View(places, mesh.triangles, colors, title or f"{len(mesh.vertices)} vertices")


def plot_mesh(self, **how):
    """Show it so that it turns under the mouse: `filigree.plot`, whose options it takes."""
    return plot(self, **how)


def plot_pose(self, model=None, **how):
    """Show a pose: the mesh that `model` restores from it, or without a model the driver's vertices. Other parameters: see `plot`."""
    return plot(_core.restore(model, self) if model is not None else self.positions, **how)


def _png(picture):
    """A picture, uint8 (h, w, 4), as the bytes of a PNG."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = picture.shape[:2]
    rows = numpy.concatenate([numpy.zeros((height, 1), numpy.uint8), picture.reshape(height, -1)], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b"")


def _card(name, numbers, mesh=None):
    """A picture beside a table of numbers; the picture is left out where nothing can draw it."""
    picture = ""
    if mesh is not None and 0 < len(mesh.vertices) <= _MOST_DRAWN:
        try:
            drawn = _core.render(mesh, width=320, height=240, passes=2)
            data = base64.b64encode(_png(drawn)).decode()
            picture = f'<td><img alt="" width="320" height="240" src="data:image/png;base64,{data}"></td>'
        except _core.Error:
            pass
    rows = "".join(
        f"<tr><th style='text-align:left'>{html.escape(str(k))}</th><td>{html.escape(str(v))}</td></tr>"
        for k, v in numbers.items()
    )
    return f"<table><tr>{picture}<td><b>filigree.{name}</b><table>{rows}</table></td></tr></table>"


def _of_mesh(self):
    low, high = self.bounds if len(self.vertices) else numpy.zeros((2, 3))
    return _card(
        "Mesh",
        {
            "vertices": len(self.vertices),
            "faces": len(self.face_offsets) - 1 if len(self.face_offsets) else 0,
            "size": " x ".join(f"{side:.4g}" for side in high - low),
            "attributes": ", ".join(k for k in ("normals", "uvs", "colors") if getattr(self, k) is not None) or "none",
        },
        self,
    )


def _of_model(self):
    mesh = self.mesh
    return _card(
        "Model",
        {"vertices": len(mesh.vertices), "driver": f"{len(self.driver_vertices)} vertices", "levels": self.finest_level + 1},
        mesh,
    )


def _of_pose(self):
    return _card("Pose", {"vertices": len(self), "gradients": "yes" if self.gradients is not None else "no: estimated"})


def _of_body(self):
    numbers = {
        "material": f"{self.material.model}, {self.material.young_modulus:.3g} Pa, {self.material.density:.4g} kg/m³",
        "particles": len(self),
        "cells": len(self.cells),
        "spacing": f"{self.spacing:.3g} m",
        "mass": f"{float(self.mass.sum()):.4g} kg",
    }
    return _card("Body", numbers)


def put_onto_classes():
    _core.Mesh._repr_html_ = _of_mesh
    _core.Mesh.plot = plot_mesh
    _core.Model._repr_html_ = _of_model
    _core.Model.plot = plot_mesh
    _core.Pose._repr_html_ = _of_pose
    _core.Pose.plot = plot_pose
    _core.Body._repr_html_ = _of_body
