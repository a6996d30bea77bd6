// dtr/gl/pixel_kernel_weights-inl.h -- SPEC 4.5, 4.6 and 4.8: what views weigh at a pixel. Compiled
// per instruction set: include only from pixel_kernel.cpp.
#if defined(DTR_GL_PIXEL_KERNEL_WEIGHTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_GL_PIXEL_KERNEL_WEIGHTS_INL_H_
#undef DTR_GL_PIXEL_KERNEL_WEIGHTS_INL_H_
#else
#define DTR_GL_PIXEL_KERNEL_WEIGHTS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::gl::HWY_NAMESPACE {

constexpr float kMinOthers = 1e-6f;
constexpr float kHalfPi = 1.57079632679f;
// As weights.glsl: stands for the logarithm of 0. Beyond any angle: stands for a hidden fragment's.
constexpr float kNoWeight = -1e38f, kHidden = 10;

/// The pixels of a group and what the views say of them.
struct Group {
  HWY_ALIGN float inverse_depth[kMaxPixelViews][kLanes];  ///< fragments; 0: none
  HWY_ALIGN float image_x[kMaxPixelViews][kLanes];        ///< on the view's image
  HWY_ALIGN float image_y[kMaxPixelViews][kLanes];
  HWY_ALIGN float angle[kMaxPixelViews][kLanes];   ///< of SPEC 4.5; not with `inverse-angle`
  HWY_ALIGN float weight[kMaxPixelViews][kLanes];  ///< up to a common factor
};

/// The angle t of SPEC 4.5 at the point at inverse depth w: its sine squared and its cosine, both
/// times a common factor. From the view's centre, so that nothing cancels where t is small.
struct Angle {
  VF across_squared, along;
  HWY_INLINE Angle(const PixelView& view, const Rays& rays, VF w) {
    const VF c = hn::MulAdd(rays.x, Constant(view.centre[0]),
                            Constant(view.centre[1] * rays.y + view.centre[2]));
    const VF across = hn::Max(
        hn::NegMulAdd(c, c, hn::Mul(Constant(view.centre_squared), rays.squared)), hn::Zero(DF()));
    across_squared = hn::Mul(hn::Mul(w, w), across);
    along = hn::NegMulAdd(w, c, rays.squared);
  }
};

/// 1 / (tan^2 t + t_pixel^2); 0 from 90 degrees on.
HWY_INLINE VF SayAt(const Angle& angle, float pixel_angle_rad) {
  const VF along_squared = hn::Mul(angle.along, angle.along);
  const VF say = hn::Div(
      along_squared,
      hn::MulAdd(along_squared, Constant(pixel_angle_rad * pixel_angle_rad), angle.across_squared));
  return hn::IfThenElseZero(hn::Gt(angle.along, hn::Zero(DF())), say);
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

/// What a group's fragments weigh together.
struct Weighed {
  VF total;    ///< of the weights
  VF blended;  ///< SPEC 6.1: how many are above 0
};

/// The fragments that lie at `border` or nearer, SPEC 4.3.
HWY_INLINE MF ShownAt(const Group& group, size_t view, VF border) {
  const VF w = hn::Load(DF(), group.inverse_depth[view]);
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
      const Angle angle(views[i], rays, hn::Load(d, group->inverse_depth[i]));
      const VF base =
          hn::Div(Constant(1), hn::Add(RadiansOf(angle), Constant(row.pixel_angle_rad)));
      weight = base;
      for (int k = 1; k < row.blend_k; ++k) weight = hn::Mul(weight, base);
      weight = hn::IfThenElseZero(shown, weight);
      sum.blended = hn::Add(sum.blended, hn::IfThenElseZero(shown, Constant(1)));
      sum.total = hn::Add(sum.total, weight);
    }
    hn::Store(weight, d, group->weight[i]);
  }
  return sum;
}

/// t_(k+1) of `k-nearest`.
HWY_INLINE VF NextAngle(const PixelRow& row, size_t views, const Group& group) {
  const DF d;
  const VF enough = Constant(static_cast<float>(row.blend_k) + 1);
  VF next = Constant(kHidden);
  for (size_t i = 0; i < views; ++i) {
    const VF t = hn::Load(d, group.angle[i]);
    VF not_larger = hn::Zero(d);
    for (size_t j = 0; j < views; ++j) {
      not_larger = hn::Add(not_larger,
                           hn::IfThenElseZero(hn::Le(hn::Load(d, group.angle[j]), t), Constant(1)));
    }
    next = hn::IfThenElse(hn::Ge(not_larger, enough), hn::Min(next, t), next);
  }
  return hn::IfThenElse(hn::Lt(next, Constant(kHidden)), next, Constant(row.max_angle_rad));
}

HWY_INLINE VF LogOrNone(VF weight) {
  const DF d;
  const MF positive = hn::Gt(weight, hn::Zero(d));
  return hn::IfThenElse(positive, hn::Log(d, hn::IfThenElse(positive, weight, Constant(1))),
                        Constant(kNoWeight));
}

/// The logarithm of any weight but the default one; kNoWeight where it is 0.
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
      break;
  }
  return Constant(kNoWeight);
}

/// SPEC 4.6 for the other weights: compared as logarithms.
HWY_INLINE Weighed WeighByLogarithms(const PixelRow& row, std::span<const PixelView> views,
                                     const Rays& rays, VF border, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d), one = Constant(1), hidden = Constant(kHidden);
  VF smallest = hidden;
  for (size_t i = 0; i < views.size(); ++i) {
    const MF shown = ShownAt(*group, i, border);
    VF t = hidden;
    if (!hn::AllFalse(d, shown)) {
      t = RadiansOf({views[i], rays, hn::Load(d, group->inverse_depth[i])});
      t = hn::IfThenElse(shown, t, hidden);
    }
    smallest = hn::Min(smallest, t);
    hn::Store(t, d, group->angle[i]);
  }
  const VF next_angle = row.blend == BlendWeight::kKNearest ? NextAngle(row, views.size(), *group)
                                                            : Constant(row.max_angle_rad);
  Weighed sum{zero, zero};
  VF largest = Constant(kNoWeight);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF t = hn::Load(d, group->angle[i]);
    const VF weight =
        hn::IfThenElse(hn::Lt(t, hidden), LogWeight(row, t, next_angle), Constant(kNoWeight));
    largest = hn::Max(largest, weight);
    sum.blended =
        hn::Add(sum.blended, hn::IfThenElseZero(hn::Gt(weight, Constant(kNoWeight)), one));
    hn::Store(weight, d, group->weight[i]);
  }
  const MF all_zero = hn::And(hn::Eq(sum.blended, zero), hn::Lt(smallest, hidden));
  for (size_t i = 0; i < views.size(); ++i) {
    const VF log = hn::Load(d, group->weight[i]);
    const MF best = hn::And(all_zero, hn::Eq(hn::Load(d, group->angle[i]), smallest));
    const VF some =
        hn::IfThenElseZero(hn::Gt(log, Constant(kNoWeight)), hn::Exp(d, hn::Sub(log, largest)));
    const VF weight = hn::IfThenElse(best, one, some);
    sum.blended = hn::Add(sum.blended, hn::IfThenElseZero(best, one));
    sum.total = hn::Add(sum.total, weight);
    hn::Store(weight, d, group->weight[i]);
  }
  return sum;
}

HWY_INLINE Weighed WeighFragments(const PixelRow& row, std::span<const PixelView> views,
                                  const Rays& rays, VF border, Group* group) {
  return row.blend == BlendWeight::kInverseAngle
             ? WeighByInverseAngle(row, views, rays, border, group)
             : WeighByLogarithms(row, views, rays, border, group);
}

/// SPEC 4.8: what is left of a view's share of the weights. Of shares, since the product of two
/// weights need not fit float32.
HWY_INLINE VF FadedShare(VF share, VF factor) {
  const VF others =
      hn::Add(Constant(kMinOthers), hn::Max(hn::Sub(Constant(1), share), hn::Zero(DF())));
  const VF rest = hn::MulAdd(hn::Sub(Constant(1), factor), share, others);
  return hn::Div(hn::Mul(hn::Mul(share, factor), others), rest);
}

}  // namespace dtr::gl::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
