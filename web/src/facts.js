// What the panel says about the file: sizes beside other ways to store the animation, counts, errors.

const kPointCacheHeader = 32, kBytesAPosition = 12;

export function count_text(count) {
  return Math.round(count).toLocaleString('en');
}

/// 3,720,000 as "3.72 MB".
export function size_text(bytes) {
  const units = ['bytes', 'kB', 'MB', 'GB'];
  let unit = 0;
  for (; bytes >= 999.5 && unit < 3; ++unit) bytes /= 1000;
  return `${unit === 0 || bytes >= 100 ? Math.round(bytes) : bytes.toPrecision(3)} ${units[unit]}`;
}

/// 2.13e-6 as "2.1 × 10⁻⁶".
export function small_text(value) {
  if (!(value > 0)) return '0';
  const [digits, exponent] = value.toExponential(1).split('e');
  const raised = String(Number(exponent)).replace(/./g, (letter) => '⁰¹²³⁴⁵⁶⁷⁸⁹⁻'['0123456789-'.indexOf(letter)]);
  return `${digits} × 10${raised}`;
}

/// [{ name, bytes }] of this file and of the same animation stored vertex by vertex; the file alone where nothing moves.
export function sizes_of(model) {
  const sizes = [{ name: 'This file', bytes: model.bytes }];
  const keys = model.report.keys ?? model.times.length;
  if (!model.action || keys < 2 || model.key_frames?.length > 0) return sizes; // a point cache has one set of faces
  const vertices = model.report.vertices ?? model.levels[0].vertices;
  const positions = vertices * keys * kBytesAPosition;
  sizes.push({ name: 'As a point cache', bytes: positions + kPointCacheHeader });
  const is_morph = model.levels[0].meshes.some((mesh) => mesh.geometry.morphAttributes.position);
  if (!is_morph) sizes.push({ name: 'As morph targets', bytes: positions + 4 * keys * keys });
  return sizes;
}

/// [[name, value]] of everything the file tells.
export function facts_of(model) {
  const facts = [], report = model.report, finest = model.levels[0], counts = model.shown_counts ?? finest;
  facts.push(['Vertices', count_text(report.vertices ?? counts.vertices)]);
  facts.push(['Triangles', count_text(counts.triangles)]);
  const joints = report.joints || finest.meshes.find((mesh) => mesh.isSkinnedMesh)?.skeleton.bones.length;
  if (joints) facts.push(['Joints', count_text(joints)]);
  if (model.action) {
    facts.push([model.key_frames?.length > 0 ? 'Key frames' : 'Keys', count_text(report.keys ?? model.times.length)]);
    facts.push(['Seconds', String(Number(model.duration.toFixed(2)))]);
  }
  if (report.error_at_keys !== undefined) facts.push(['Largest error at keys', small_text(report.error_at_keys)]);
  if (report.error_between_keys !== undefined) facts.push(['Between keys', small_text(report.error_between_keys)]);
  return facts;
}
