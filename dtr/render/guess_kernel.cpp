#include "dtr/render/guess_kernel.h"

#include <cstdint>
#include <iterator>
#include <numbers>

#include "dtr/render/geometry.h"

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/render/guess_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h.
#include "dtr/render/quick_angle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace dtr::HWY_NAMESPACE {

// Products and sums apart, never fused: images are the same on every processor.
constexpr int kTriedDepths = 8;    // SPEC 7.2
constexpr double kMinFade = 1e-3;  // a lone view answers too

HWY_INLINE VD Constant(double value) { return hn::Set(DD(), value); }

/// Points of the row in a view.
struct Seen {
  VD x, y, per_z;
  MD on_photo;
};

HWY_INLINE Seen PutBefore(const GuessView& view, VD x, VD w) {
  VD p[3];
  for (size_t i = 0; i < 3; ++i) {
    const VD at_infinity =
        hn::Add(Constant(view.pixel_at_0[i]), hn::Mul(x, Constant(view.pixel_per_x[i])));
    p[i] = hn::Add(at_infinity, hn::Mul(w, Constant(view.pixel_per_inverse_depth[i])));
  }
  const VD zero = Constant(0), per_z = hn::Div(Constant(1), p[2]);
  const VD px = hn::Mul(p[0], per_z), py = hn::Mul(p[1], per_z);
  const MD inside = hn::And(hn::And(hn::Ge(px, zero), hn::Lt(px, Constant(view.width_px))),
                            hn::And(hn::Ge(py, zero), hn::Lt(py, Constant(view.height_px))));
  return {px, py, per_z, hn::And(hn::Gt(p[2], zero), inside)};
}

/// Depth that the view measured there. Of no meaning off the photo.
HWY_INLINE VD MeasuredAt(const GuessView& view, const Seen& seen) {
  const DD d;
  const hn::Rebind<std::int32_t, DD> di;
  VD column = hn::IfThenElseZero(seen.on_photo, seen.x);
  VD row = hn::IfThenElseZero(seen.on_photo, seen.y);
  if (view.depth_scale != 1) {
    const VD scale = Constant(view.depth_scale);
    column = hn::Div(hn::Floor(column), scale), row = hn::Div(hn::Floor(row), scale);
  }
  const auto index = hn::Add(hn::Mul(hn::DemoteTo(di, row), hn::Set(di, view.depth_columns)),
                             hn::DemoteTo(di, column));
  return hn::PromoteTo(d, hn::GatherIndex(hn::Rebind<float, DD>(), view.depth, index));
}

/// Lanes whose points the view sees through.
HWY_INLINE MD SeenThrough(const GuessView& view, VD x, VD w) {
  const Seen seen = PutBefore(view, x, w);
  if (hn::AllFalse(DD(), seen.on_photo)) return seen.on_photo;
  const VD measured = MeasuredAt(view, seen);
  const VD before = hn::Sub(hn::Mul(w, seen.per_z), Constant(view.delta));
  const MD behind = hn::Gt(hn::Mul(measured, before), Constant(1));
  return hn::And(seen.on_photo, hn::And(hn::Gt(measured, Constant(0)), behind));
}

void FindGuessesImpl(std::span<const GuessView> views, const GuessLanes& x_of,
                     const GuessLanes& farthest_of, const GuessLanes& nearest_of, size_t& sceptic,
                     GuessLanes& inverse_depth) {
  const DD d;
  for (size_t lane = 0; lane < kGuessesTogether; lane += kLanes) {
    const VD x = hn::LoadU(d, x_of + lane), farthest = hn::LoadU(d, farthest_of + lane);
    const VD range = hn::Sub(hn::LoadU(d, nearest_of + lane), farthest);
    VD found = farthest;
    MD open = hn::Gt(hn::LoadU(d, nearest_of + lane), farthest);
    for (int k = kTriedDepths - 1; k > 0 && !hn::AllFalse(d, open); --k) {
      const VD tried =
          hn::Add(farthest, hn::Div(hn::Mul(range, Constant(k)), Constant(kTriedDepths - 1)));
      MD kept = open;
      for (size_t n = 0; n < views.size() && !hn::AllFalse(d, kept); ++n) {
        // The last sceptic first, then in turn: order decides nothing but the time.
        const size_t i = n == 0 ? sceptic : n - (n <= sceptic ? 1 : 0);
        kept = hn::AndNot(SeenThrough(views[i], x, tried), kept);
        if (hn::AllFalse(d, kept)) sceptic = i;
      }
      found = hn::IfThenElse(kept, tried, found);
      open = hn::AndNot(kept, open);
    }
    hn::StoreU(found, d, inverse_depth + lane);
  }
}

void AskViewsImpl(std::span<const GuessView> views, const GuessLanes& x_of,
                  const GuessLanes& inverse_depth, GuessAnswers& answers) {
  const DD d;
  const VD zero = Constant(0), one = Constant(1);
  for (size_t lane = 0; lane < kGuessesTogether; lane += kLanes) {
    const VD x = hn::LoadU(d, x_of + lane), w = hn::LoadU(d, inverse_depth + lane);
    for (size_t v = 0; v < views.size(); ++v) {
      const Seen seen = PutBefore(views[v], x, w);
      const VD measured = MeasuredAt(views[v], seen);
      const VD behind = hn::Add(hn::Mul(w, seen.per_z), Constant(views[v].delta));
      const MD hidden = hn::And(hn::Gt(measured, zero), hn::Lt(hn::Mul(measured, behind), one));
      const MD answer = hn::AndNot(hidden, seen.on_photo);
      GuessAnswers::OfView& of = answers.views[v];
      hn::StoreU(hn::IfThenElseZero(answer, one), d, of.answers + lane);
      hn::StoreU(seen.x, d, of.pixel_x + lane);
      hn::StoreU(seen.y, d, of.pixel_y + lane);
    }
  }
}

/// From nearly 0 at the rim of a photo to 1 where it is farther in: no border of a photo shows in
/// what is filled.
HWY_INLINE VD FadeAtRim(const GuessView& view, VD x, VD y) {
  const VD right = hn::Sub(Constant(view.width_px), x);
  const VD lower = hn::Sub(Constant(view.height_px), y);
  const VD to_rim = hn::Min(hn::Min(x, y), hn::Min(right, lower));
  const VD share = hn::Div(to_rim, Constant(view.fade_width_px));
  const VD t = hn::Min(hn::Max(share, Constant(kMinFade)), Constant(1));
  return hn::Mul(hn::Mul(t, t), hn::Sub(Constant(3), hn::Mul(Constant(2), t)));
}

void AnglesOfViewsImpl(std::span<const GuessView> views, const GuessRow& row,
                       const GuessLanes& x_of, const GuessLanes& inverse_depth,
                       GuessAnswers& answers) {
  const DD d;
  const VD one = Constant(1);
  for (size_t lane = 0; lane < kGuessesTogether; lane += kLanes) {
    const VD x = hn::LoadU(d, x_of + lane), w = hn::LoadU(d, inverse_depth + lane);
    const VD ray[3] = {
        hn::Div(hn::Sub(hn::Add(x, Constant(0.5)), Constant(row.cx_px)), Constant(row.fx_px)),
        Constant(row.ray_y), one};
    const VD ray_squared = hn::Add(hn::Add(hn::Mul(ray[0], ray[0]), hn::Mul(ray[1], ray[1])), one);
    for (size_t v = 0; v < views.size(); ++v) {
      GuessAnswers::OfView& of = answers.views[v];
      const VD px = hn::LoadU(d, of.pixel_x + lane), py = hn::LoadU(d, of.pixel_y + lane);
      hn::StoreU(FadeAtRim(views[v], px, py), d, of.fade + lane);
      // Angle at the point ray / w between c - ray / w and -ray / w, both times w.
      VD c[3], across = Constant(0), along = Constant(0);
      for (size_t i = 0; i < 3; ++i) c[i] = hn::Mul(w, Constant(views[v].centre[i]));
      for (size_t i = 0; i < 3; ++i) {
        const size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const VD side = hn::Sub(hn::Mul(c[j], ray[k]), hn::Mul(c[k], ray[j]));
        across = hn::Add(across, hn::Mul(side, side));
        along = hn::Add(along, hn::Mul(c[i], ray[i]));
      }
      hn::StoreU(QuickAngles(hn::Sqrt(across), hn::Sub(ray_squared, along)), d,
                 of.angle_rad + lane);
    }
  }
}

HWY_INLINE VD Power(VD base, int exponent) {
  VD power = Constant(1);
  for (; exponent > 0; exponent /= 2, base = hn::Mul(base, base)) {
    if (exponent % 2 == 1) power = hn::Mul(power, base);
  }
  return power;
}

void ShareByInverseAngleImpl(double pixel_angle_rad, int power, GuessAnswers& answers) {
  const DD d;
  const VD pixel_angle = Constant(pixel_angle_rad);
  for (size_t lane = 0; lane < kGuessesTogether; lane += kLanes) {
    VD smallest = Constant(4);  // beyond any angle
    for (const auto& of : answers.views) {
      const MD answer = hn::Gt(hn::LoadU(d, of.answers + lane), Constant(0));
      const VD angle = hn::LoadU(d, of.angle_rad + lane);
      smallest = hn::IfThenElse(answer, hn::Min(smallest, angle), smallest);
    }
    smallest = hn::Add(smallest, pixel_angle);
    VD sum = Constant(0);
    for (auto& of : answers.views) {
      const MD answer = hn::Gt(hn::LoadU(d, of.answers + lane), Constant(0));
      const VD angle = hn::Add(hn::LoadU(d, of.angle_rad + lane), pixel_angle);
      const VD weight = hn::IfThenElseZero(answer, Power(hn::Div(smallest, angle), power));
      sum = hn::Add(sum, weight);
      hn::StoreU(weight, d, of.share + lane);
    }
    for (auto& of : answers.views) {
      hn::StoreU(hn::Div(hn::LoadU(d, of.share + lane), sum), d, of.share + lane);
    }
  }
}

/// As dtr::Exposed.
HWY_INLINE VD InExposure(VD linear, double exposure) {
  if (exposure == 1) return linear;
  const double fourth = exposure * exposure * exposure * exposure;
  const VD power = hn::Mul(hn::Mul(hn::Mul(linear, linear), linear), linear);
  const VD bent = hn::Add(Constant(1), hn::Mul(Constant(fourth - 1), power));
  return hn::Div(hn::Mul(Constant(exposure), linear), hn::Sqrt(hn::Sqrt(bent)));
}

void MixAnswersImpl(std::span<const GuessView> views, GuessAnswers& answers, GuessLanes (&rgb)[3],
                    GuessLanes& answered) {
  const DD d;
  const VD zero = Constant(0), one = Constant(1);
  for (size_t lane = 0; lane < kGuessesTogether; lane += kLanes) {
    VD sum[3] = {zero, zero, zero}, first[3] = {zero, zero, zero}, shares = zero, count = zero;
    for (size_t v = 0; v < views.size(); ++v) {
      const GuessAnswers::OfView& of = answers.views[v];
      const MD answer = hn::Gt(hn::LoadU(d, of.answers + lane), zero);
      if (hn::AllFalse(d, answer)) continue;
      const MD is_first = hn::And(answer, hn::Eq(count, zero));
      const VD share = hn::IfThenElseZero(
          answer, hn::Mul(hn::LoadU(d, of.share + lane), hn::LoadU(d, of.fade + lane)));
      for (size_t c = 0; c < 3; ++c) {
        const VD colour = InExposure(hn::LoadU(d, of.rgb[c] + lane), views[v].exposure[c]);
        first[c] = hn::IfThenElse(is_first, colour, first[c]);
        sum[c] = hn::Add(sum[c], hn::IfThenElseZero(answer, hn::Mul(share, colour)));
      }
      shares = hn::Add(shares, share);
      count = hn::Add(count, hn::IfThenElseZero(answer, one));
    }
    // All shares may be too small to be told from 0; a lone view's colour is not to be rounded.
    const MD mixed = hn::And(hn::Gt(count, one), hn::Gt(shares, zero));
    for (size_t c = 0; c < 3; ++c) {
      hn::StoreU(hn::IfThenElse(mixed, hn::Div(sum[c], shares), first[c]), d, rgb[c] + lane);
    }
    hn::StoreU(hn::Min(count, one), d, answered + lane);
  }
}

}  // namespace dtr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr {

HWY_EXPORT(FindGuessesImpl);
HWY_EXPORT(AskViewsImpl);
HWY_EXPORT(AnglesOfViewsImpl);
HWY_EXPORT(ShareByInverseAngleImpl);
HWY_EXPORT(MixAnswersImpl);

void FindGuesses(std::span<const GuessView> views, const GuessLanes& x, const GuessLanes& farthest,
                 const GuessLanes& nearest, size_t& sceptic, GuessLanes& inverse_depth) {
  HWY_DYNAMIC_DISPATCH(FindGuessesImpl)(views, x, farthest, nearest, sceptic, inverse_depth);
}

void AskViews(std::span<const GuessView> views, const GuessLanes& x,
              const GuessLanes& inverse_depth, GuessAnswers& answers) {
  HWY_DYNAMIC_DISPATCH(AskViewsImpl)(views, x, inverse_depth, answers);
}

void AnglesOfViews(std::span<const GuessView> views, const GuessRow& row, const GuessLanes& x,
                   const GuessLanes& inverse_depth, GuessAnswers& answers) {
  HWY_DYNAMIC_DISPATCH(AnglesOfViewsImpl)(views, row, x, inverse_depth, answers);
}

void ShareByInverseAngle(double pixel_angle_rad, int power, GuessAnswers& answers) {
  HWY_DYNAMIC_DISPATCH(ShareByInverseAngleImpl)(pixel_angle_rad, power, answers);
}

void MixAnswers(std::span<const GuessView> views, GuessAnswers& answers, GuessLanes (&rgb)[3],
                GuessLanes& answered) {
  HWY_DYNAMIC_DISPATCH(MixAnswersImpl)(views, answers, rgb, answered);
}

}  // namespace dtr
#endif
