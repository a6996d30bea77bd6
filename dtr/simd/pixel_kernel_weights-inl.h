// dtr/simd/pixel_kernel_weights-inl.h -- SPEC 4.5, 4.6 and 4.8: what views weigh at a pixel.
// Compiled per instruction set: include only from pixel_kernel.cpp.
#if defined(DTR_SIMD_PIXEL_KERNEL_WEIGHTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_SIMD_PIXEL_KERNEL_WEIGHTS_INL_H_
#undef DTR_SIMD_PIXEL_KERNEL_WEIGHTS_INL_H_
#else
#define DTR_SIMD_PIXEL_KERNEL_WEIGHTS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::simd::HWY_NAMESPACE {

constexpr float kMinOthers = 1e-6f;
constexpr float kHalfPi = 1.57079632679f;
// As weights.glsl: stands for the logarithm of 0. Beyond any angle: stands for a hidden fragment's.
constexpr float kNoWeight = -1e38f, kHidden = 10;
// SPEC 1.4.
constexpr float kFallingShare = 0.25f, kMinFactor = 1.0f / 255;

/// The pixels of a group and what the views show of them: per view a vector of each.
class Group {
 public:
  explicit Group(size_t views)
      : values_(hwy::AllocateAligned<float>(kQuantities * kLanes * views)) {}
  float* inverse_depth(size_t view) { return At(view, 0); }  ///< fragments; 0: none
  float* image_x(size_t view) { return At(view, 1); }        ///< on the view's image
  float* image_y(size_t view) { return At(view, 2); }
  /// Of SPEC 4.5; with `inverse-angle` only by the per-pixel rule.
  float* angle(size_t view) { return At(view, 3); }
  float* weight(size_t view) { return At(view, 4); }  ///< up to a common factor

 private:
  static constexpr size_t kQuantities = 5;
  float* At(size_t view, size_t quantity) {
    return values_.get() + (view * kQuantities + quantity) * kLanes;
  }
  hwy::AlignedFreeUniquePtr<float[]> values_;
};

/// The angle t of SPEC 4.5 at the point at inverse depth w: its sine squared and its cosine, both
/// times a common factor. From the view's centre, so that nothing cancels where t is small.
struct Angle {
  VF across_squared, along;
  HWY_INLINE Angle(const PixelRow& row, const PixelView& view, const Rays& rays, VF w) {
    w = hn::Max(w, Constant(row.least_inverse_depth));
    const VF c = hn::MulAdd(rays.x, Constant(view.centre[0]),
                            Constant(view.centre[1] * rays.y + view.centre[2]));
    const VF across = hn::Max(
        hn::NegMulAdd(c, c, hn::Mul(Constant(view.centre_squared), rays.squared)), hn::Zero(DF()));
    across_squared = hn::Mul(hn::Mul(w, w), across);
    along = hn::NegMulAdd(w, c, rays.squared);
  }
};

/// 1 / (tan^2 t + t_pixel^2); 0 from 90 degrees on.
HWY_INLINE VF VoteWeightAt(const Angle& angle, float pixel_angle_rad) {
  const VF along_squared = hn::Mul(angle.along, angle.along);
  const VF vote = hn::Div(
      along_squared,
      hn::MulAdd(along_squared, Constant(pixel_angle_rad * pixel_angle_rad), angle.across_squared));
  return hn::IfThenElseZero(hn::Gt(angle.along, hn::Zero(DF())), vote);
}

/// t in radians; off by less than 3e-5 of itself (minimax polynomial), far below what shows in 8
/// bits.
HWY_INLINE VF RadiansOf(const Angle& angle) {
  const DF d;
  const VF across = hn::Sqrt(angle.across_squared), along = hn::Abs(angle.along);
  const VF longer = hn::Max(hn::Max(across, along), Constant(1e-30f));
  const VF a = hn::Div(hn::Min(across, along), longer), s = hn::Mul(a, a);
  VF p = Constant(-0.01172120f);
  for (const float coefficient :
       {0.05265332f, -0.11643287f, 0.19354346f, -0.33262347f, 0.99997726f}) {
    p = hn::MulAdd(p, s, Constant(coefficient));
  }
  VF t = hn::Mul(a, p);
  t = hn::IfThenElse(hn::Gt(across, along), hn::Sub(Constant(kHalfPi), t), t);
  return hn::IfThenElse(hn::Lt(angle.along, hn::Zero(d)), hn::Sub(Constant(3.14159265359f), t), t);
}

/// The same to float32's last digits.
HWY_INLINE VF PreciseRadiansOf(const Angle& angle) {
  const DF d;
  const VF across = hn::Sqrt(angle.across_squared), along = hn::Abs(angle.along);
  const VF longer = hn::Max(hn::Max(across, along), Constant(1e-30f));
  VF t = hn::Atan(d, hn::Div(hn::Min(across, along), longer));
  t = hn::IfThenElse(hn::Gt(across, along), hn::Sub(Constant(kHalfPi), t), t);
  return hn::IfThenElse(hn::Lt(angle.along, hn::Zero(d)), hn::Sub(Constant(3.14159265359f), t), t);
}

/// What a group's fragments weigh together.
struct Weighed {
  VF total;    ///< of the weights
  VF blended;  ///< SPEC 6.1: how many are above 0
};

/// The fragments that lie at `border` or nearer, SPEC 4.3.
HWY_INLINE MF ShownAt(Group& group, size_t view, VF border) {
  const VF w = hn::Load(DF(), group.inverse_depth(view));
  return hn::And(hn::Gt(w, hn::Zero(DF())), hn::Ge(w, border));
}

/// The default weight, which needs no logarithm where its range fits float32.
HWY_INLINE Weighed WeighByInverseAngle(const PixelRow& row, std::span<const PixelView> views,
                                       const Rays& rays, VF border, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d);
  Weighed sum{zero, zero};
  for (size_t i = 0; i < views.size(); ++i) {
    const MF shown = ShownAt(*group, i, border);
    VF weight = zero;
    if (!hn::AllFalse(d, shown)) {
      const Angle angle(row, views[i], rays, hn::Load(d, group->inverse_depth(i)));
      const VF base =
          hn::Div(Constant(1), hn::Add(RadiansOf(angle), Constant(row.pixel_angle_rad)));
      weight = base;
      for (int k = 1; k < row.blend_k; ++k) weight = hn::Mul(weight, base);
      weight = hn::IfThenElseZero(shown, weight);
      sum.blended = hn::Add(sum.blended, hn::IfThenElseZero(shown, Constant(1)));
      sum.total = hn::Add(sum.total, weight);
    }
    hn::Store(weight, d, group->weight(i));
  }
  return sum;
}

/// The rank-th smallest angle (0: the smallest) of the group's fragments; kHidden where there are
/// no more.
HWY_INLINE VF RankedAngle(size_t views, int rank, Group* group) {
  const DF d;
  const VF enough = Constant(static_cast<float>(rank) + 1);
  VF ranked = Constant(kHidden);
  for (size_t i = 0; i < views; ++i) {
    const VF t = hn::Load(d, group->angle(i));
    if (hn::AllTrue(d, hn::Ge(t, ranked))) continue;
    VF not_larger = hn::Zero(d);
    for (size_t j = 0; j < views; ++j) {
      not_larger = hn::Add(
          not_larger, hn::IfThenElseZero(hn::Le(hn::Load(d, group->angle(j)), t), Constant(1)));
    }
    ranked = hn::IfThenElse(hn::Ge(not_larger, enough), hn::Min(ranked, t), ranked);
  }
  return ranked;
}

/// The same, the largest angle that counts where there are no more.
HWY_INLINE VF RankedAngleOrMost(const PixelRow& row, size_t views, int rank, Group* group) {
  const VF ranked = RankedAngle(views, rank, group);
  return hn::IfThenElse(hn::Lt(ranked, Constant(kHidden)), ranked, Constant(row.max_angle_rad));
}

HWY_INLINE VF LogOrNone(VF weight) {
  const DF d;
  const MF positive = hn::Gt(weight, hn::Zero(d));
  return hn::IfThenElse(positive, hn::Log(d, hn::IfThenElse(positive, weight, Constant(1))),
                        Constant(kNoWeight));
}

/// The logarithm of a weight; kNoWeight where it is 0.
HWY_INLINE VF LogWeight(const PixelRow& row, VF t, VF next_angle) {
  const DF d;
  switch (row.blend) {
    case BlendWeight::kCosine: {
      const VF cosine = hn::Max(hn::Cos(d, t), Constant(1e-30f));
      return hn::IfThenElse(hn::Lt(t, Constant(kHalfPi)),
                            hn::Mul(Constant(row.exponent), hn::Log(d, cosine)),
                            Constant(kNoWeight));
    }
    case BlendWeight::kExponential:
      return hn::Mul(Constant(-row.falloff), t);
    case BlendWeight::kAngle:
    case BlendWeight::kKNearest: {
      const MF some = hn::Gt(next_angle, hn::Zero(d));
      const VF share = hn::Div(t, hn::IfThenElse(some, next_angle, Constant(1)));
      return LogOrNone(hn::IfThenElseZero(some, hn::Sub(Constant(1), share)));
    }
    case BlendWeight::kInverseAngle:
      return hn::Mul(Constant(-static_cast<float>(row.blend_k)),
                     hn::Log(d, hn::Add(t, Constant(row.pixel_angle_rad))));
  }
  return Constant(kNoWeight);
}

/// SPEC 4.6: compared as logarithms.
HWY_INLINE Weighed WeighByLogarithms(const PixelRow& row, std::span<const PixelView> views,
                                     const Rays& rays, VF border, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d), one = Constant(1), hidden = Constant(kHidden);
  VF smallest = hidden;
  for (size_t i = 0; i < views.size(); ++i) {
    const MF shown = ShownAt(*group, i, border);
    VF t = hidden;
    if (!hn::AllFalse(d, shown)) {
      const Angle angle(row, views[i], rays, hn::Load(d, group->inverse_depth(i)));
      t = row.precise_weights ? PreciseRadiansOf(angle) : RadiansOf(angle);
      t = hn::IfThenElse(shown, t, hidden);
    }
    smallest = hn::Min(smallest, t);
    hn::Store(t, d, group->angle(i));
  }
  const VF next_angle = row.blend == BlendWeight::kKNearest
                            ? RankedAngleOrMost(row, views.size(), row.blend_k, group)
                            : Constant(row.max_angle_rad);
  Weighed sum{zero, zero};
  VF largest = Constant(kNoWeight);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF t = hn::Load(d, group->angle(i));
    const VF weight =
        hn::IfThenElse(hn::Lt(t, hidden), LogWeight(row, t, next_angle), Constant(kNoWeight));
    largest = hn::Max(largest, weight);
    sum.blended =
        hn::Add(sum.blended, hn::IfThenElseZero(hn::Gt(weight, Constant(kNoWeight)), one));
    hn::Store(weight, d, group->weight(i));
  }
  const MF all_zero = hn::And(hn::Eq(sum.blended, zero), hn::Lt(smallest, hidden));
  for (size_t i = 0; i < views.size(); ++i) {
    const VF log = hn::Load(d, group->weight(i));
    const MF best = hn::And(all_zero, hn::Eq(hn::Load(d, group->angle(i)), smallest));
    const VF some =
        hn::IfThenElseZero(hn::Gt(log, Constant(kNoWeight)), hn::Exp(d, hn::Sub(log, largest)));
    const VF weight = hn::IfThenElse(best, one, some);
    sum.blended = hn::Add(sum.blended, hn::IfThenElseZero(best, one));
    sum.total = hn::Add(sum.total, weight);
    hn::Store(weight, d, group->weight(i));
  }
  return sum;
}

HWY_INLINE Weighed WeighFragments(const PixelRow& row, std::span<const PixelView> views,
                                  const Rays& rays, VF border, Group* group) {
  return row.blend == BlendWeight::kInverseAngle && !row.precise_weights
             ? WeighByInverseAngle(row, views, rays, border, group)
             : WeighByLogarithms(row, views, rays, border, group);
}

/// SPEC 1.3: drops the fragments at `border` or nearer that are not among the K nearest by angle.
/// Returns the angle of SPEC 1.4 beyond which nothing counts.
HWY_INLINE VF DropAllButNearest(const PixelRow& row, std::span<const PixelView> views,
                                const Rays& rays, VF border, Group* group) {
  const DF d;
  for (size_t i = 0; i < views.size(); ++i) {
    const MF shown = ShownAt(*group, i, border);
    VF t = Constant(kHidden);
    if (!hn::AllFalse(d, shown)) {
      t = hn::IfThenElse(
          shown, PreciseRadiansOf({row, views[i], rays, hn::Load(d, group->inverse_depth(i))}), t);
    }
    hn::Store(t, d, group->angle(i));
  }
  const VF limit = RankedAngle(views.size(), row.nearest_views - 1, group);
  const VF cut = RankedAngleOrMost(row, views.size(), row.nearest_views, group);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF t = hn::Load(d, group->angle(i)), w = hn::Load(d, group->inverse_depth(i));
    hn::Store(hn::IfThenElseZero(hn::Le(t, limit), w), d, group->inverse_depth(i));
  }
  return cut;
}

/// SPEC 1.4 at the point.
HWY_INLINE VF CutFactorAt(VF t, VF cut) {
  const VF one = Constant(1);
  const VF some = hn::Div(hn::Sub(cut, t), hn::Mul(Constant(kFallingShare), cut));
  const VF factor = hn::Min(hn::Max(some, Constant(kMinFactor)), one);
  return hn::IfThenElse(hn::Gt(cut, hn::Zero(DF())), factor, one);
}

/// SPEC 4.8: what is left of a view's share of the weights. Of shares, since the product of two
/// weights need not fit float32.
HWY_INLINE VF FadedShare(VF share, VF factor) {
  const VF others =
      hn::Add(Constant(kMinOthers), hn::Max(hn::Sub(Constant(1), share), hn::Zero(DF())));
  const VF rest = hn::MulAdd(hn::Sub(Constant(1), factor), share, others);
  return hn::Div(hn::Mul(hn::Mul(share, factor), others), rest);
}

}  // namespace dtr::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
