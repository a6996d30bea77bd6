// Which views an image is drawn from, and how: SPEC 1, 4.8 and 4.9 of docs/RENDER_SPEC.md.
import { angleBetween, angularDistance, clamp, norm, product, sub, times, transposed } from "./maths.js";
import { inCamera, pixelOf, rayOf } from "./camera.js";

/** SPEC 1.2: K. */
export const kViews = 8;
/** SPEC 1.3 has every view as a candidate; here the nearest so many are. */
export const kCandidates = 16;
export const kMaxAngle = Math.PI / 3;
const kLeastFactor = 1 / 255, kFallingShare = 0.25;
const kTurnShare = 0.3, kSamePlace = 1e-6;
const kRimShare = 1 / 48, kMinRimPx = 8, kFadePerMoved = 4;
const kNearPlaneShare = 1e-3;

/** SPEC 1.3. */
export function needsPerPixelRule(set, views, novel) {
  if (!(inCamera(novel, set.center)[2] > 0)) return true;
  const seeing = views.filter((view) => {
    const pixel = pixelOf(view, set.center);
    return pixel && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < view.width && pixel[1] < view.height;
  });
  return 2 * seeing.length <= views.length;
}

// How far a view's place and orientation are from the novel one, SPEC 4.9.
function apart(set, view, novel) {
  const reach = norm(sub(view.centre, set.center));
  const turn = angularDistance(novel.rotation, view.rotation);
  return Math.max(Math.hypot(norm(sub(view.centre, novel.centre)), kTurnShare * reach * turn), kSamePlace * reach);
}

/** Views by how much they are wanted for this camera. */
export function ranked(set, views, novel) {
  const perPixel = needsPerPixelRule(set, views, novel);
  const candidates = views.map((view) => ({
    view, distance: norm(sub(view.centre, novel.centre)),
    angle: perPixel ? apart(set, view, novel) : angleBetween(sub(view.centre, set.center), sub(novel.centre, set.center)),
  }));
  candidates.sort((a, b) => a.angle - b.angle || a.distance - b.distance || a.view.index - b.view.index);
  return { perPixel, candidates };
}

/** All views, most wanted first: those of a time step, then of the steps that follow it, from the last on to the first. */
export function wantedOrder(set, step, novel) {
  return set.steps.flatMap((_, i) => ranked(set, set.steps[(step + i) % set.steps.length], novel).candidates.map((c) => c.view));
}

function cutFactor(angle, cut) {
  return cut > 0 ? clamp((cut - angle) / (kFallingShare * cut), kLeastFactor, 1) : 1;
}

/** SPEC 1: {perPixel, views: [{view, cut}] in canonical order}. */
export function selectViews(set, views, novel) {
  const { perPixel, candidates } = ranked(set, views, novel);
  const valid = perPixel ? candidates : candidates.filter((c) => c.angle <= kMaxAngle);
  const most = perPixel ? kCandidates : kViews;
  const cut = valid.length > most ? valid[most].angle : kMaxAngle;
  const chosen = valid.slice(0, most).map((c) => ({ view: c.view, cut: perPixel ? 1 : cutFactor(c.angle, cut) }));
  return { perPixel, views: chosen.sort((a, b) => a.view.index - b.view.index) };
}

/** Images drawn from the one and the other are the same, for the same camera. */
export function sameSelection(a, b) {
  return a.perPixel === b.perPixel && a.views.length === b.views.length
    && a.views.every(({ view, cut }, i) => view === b.views[i].view && cut === b.views[i].cut);
}

/** SPEC 4.9: per channel; 1 where no view has a gain. */
export function frameExposure(set, selected, novel) {
  if (selected.every(({ view }) => view.gain.every((g) => g === 1))) return [1, 1, 1];
  const sum = [0, 0, 0];
  let total = 0;
  for (const { view, cut } of selected) {
    const distance = apart(set, view, novel);
    const weight = distance > 0 ? cut / (distance * distance) : 1;
    for (let c = 0; c < 3; ++c) sum[c] += weight * Math.log(view.gain[c]);
    total += weight;
  }
  return sum.map((s) => Math.exp(-s / total));
}

/** SPEC 0.5: novel_from_view, the view's centre in the novel frame, and where triangles are cut. */
export function placementOf(view, novel) {
  return {
    rotation: product(novel.matrix, transposed(view.matrix)),
    translation: times(novel.matrix, sub(view.centre, novel.centre)),
    nearZ: kNearPlaneShare * view.baseline,
  };
}

export const rimWidth = (view) => Math.max(kMinRimPx, Math.floor(kRimShare * Math.max(view.width, view.height)));

/** SPEC 4.4: how far what the view's photo clipped is no colour for an image of this exposure. */
export function clippedOf(view, exposure) {
  const logRatio = [0, 1, 2].reduce((sum, c) => sum + Math.log(view.gain[c] * exposure[c]), 0) / 3;
  return clamp(-4 * logRatio, 0, 1);
}

/** SPEC 4.8: how a view's rim factors become those of this image. */
export function fadingOf(set, view, placement, novel) {
  const depth = norm(sub(set.center, novel.centre));
  let moved = 0;
  for (const corner of [0, 1, 2, 3]) {
    const of = (camera) => [corner % 2 * camera.width, (corner >> 1) * camera.height];
    const p = sub(rayOf(novel, of(novel)).map((v) => v * depth), placement.translation);
    const q = times(transposed(placement.rotation), p);
    if (!(q[2] > 0)) return { gain: 1, offset: 0 };
    const at = of(view);
    moved = Math.max(moved, Math.hypot(view.fx * q[0] / q[2] + view.cx - at[0], view.fy * q[1] / q[2] + view.cy - at[1]));
  }
  const width = rimWidth(view);
  const gain = clamp(width / (kFadePerMoved * moved), 1, width + 1);
  return { gain, offset: (gain - 1) / width };
}
