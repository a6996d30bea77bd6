// stereo/patchmatch/kernel_sample-inl.h -- bilinear samples of 8-bit textures in whole numbers.
// Compiled per instruction set: include only from kernel.cpp.
#if defined(DTR_STEREO_PATCHMATCH_KERNEL_SAMPLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_STEREO_PATCHMATCH_KERNEL_SAMPLE_INL_H_
#undef DTR_STEREO_PATCHMATCH_KERNEL_SAMPLE_INL_H_
#else
#define DTR_STEREO_PATCHMATCH_KERNEL_SAMPLE_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::stereo::patchmatch::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using DI = hn::ScalableTag<std::int32_t>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

/// Positions count 2^-15 pixels. Of the fraction across, the upper 7 bits count, as 127ths: a
/// sample's place is off by 0.008 px at most and 0.003 px on average, a twentieth of what a
/// window's place is known to.
constexpr int kFractionBits = 15;
constexpr float kFixedPerPixel = 1 << kFractionBits;
/// A sample is the grey level times what its weights across and down add up to.
constexpr std::int32_t kAcross = 127, kDown = 32767;
constexpr float kGreyPerSample = 1.0f / (kAcross * kDown);

HWY_INLINE VI Fixed(VF pixels) {
  return hn::NearestInt(hn::Mul(pixels, hn::Set(DF(), kFixedPerPixel)));
}

// Every path gives the same whole numbers.
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSSE3  // better targets have lower numbers

using D16 = hn::Repartition<std::int16_t, DI>;
using D8 = hn::Repartition<std::uint8_t, DI>;

/// Sums of two products: of unsigned with signed bytes, and of signed words.
HWY_INLINE VI PairsOfBytes(VI a, VI b) {
#if HWY_TARGET <= HWY_AVX3
  return VI{_mm512_maddubs_epi16(a.raw, b.raw)};
#elif HWY_TARGET == HWY_AVX2
  return VI{_mm256_maddubs_epi16(a.raw, b.raw)};
#else
  return VI{_mm_maddubs_epi16(a.raw, b.raw)};
#endif
}
HWY_INLINE VI PairsOfWords(VI a, VI b) {
#if HWY_TARGET <= HWY_AVX3
  return VI{_mm512_madd_epi16(a.raw, b.raw)};
#elif HWY_TARGET == HWY_AVX2
  return VI{_mm256_madd_epi16(a.raw, b.raw)};
#else
  return VI{_mm_madd_epi16(a.raw, b.raw)};
#endif
}

/// Samples a texture at u, v pixels, fixed point, from the quads with the indices `base`.
class Sampler {
 public:
  HWY_INLINE Sampler(const std::int32_t* quads, VI base, int stride)
      : quads_(quads),
        base_(base),
        steps_(hn::Set(DI(), static_cast<std::int32_t>(1u | static_cast<unsigned>(stride) << 16))) {
    alignas(16) static constexpr std::uint8_t kFraction[16] = {1, 1, 1, 1, 5,  5,  5,  5,
                                                               9, 9, 9, 9, 13, 13, 13, 13};
    alignas(16) static constexpr std::uint8_t kLowWord[16] = {0, 1, 0, 1, 4,  5,  4,  5,
                                                              8, 9, 8, 9, 12, 13, 12, 13};
    fraction_ = hn::BitCast(DI(), hn::LoadDup128(D8(), kFraction));
    low_word_ = hn::BitCast(DI(), hn::LoadDup128(D8(), kLowWord));
  }

  HWY_INLINE VI At(VI u, VI v) const {
    const DI d;
    const D16 words;
    const auto places = hn::OddEven(hn::BitCast(words, hn::ShiftLeft<1>(v)),
                                    hn::BitCast(words, hn::ShiftRight<kFractionBits>(u)));
    const VI index = hn::Add(base_, PairsOfWords(hn::BitCast(d, places), steps_));
    const VI quad = hn::GatherIndex(d, quads_, index);
    const VI across = hn::Xor(hn::And(Shuffled(u, fraction_), hn::Set(d, 0x7f7f7f7f)),
                              hn::Set(d, 0x007f007f));  // 127 - f, f, 127 - f, f
    const VI down = hn::Xor(hn::And(Shuffled(v, low_word_), hn::Set(d, 0x7fff7fff)),
                            hn::Set(d, 0x00007fff));  // 32767 - g, g
    return PairsOfWords(PairsOfBytes(quad, across), down);
  }

 private:
  static HWY_INLINE VI Shuffled(VI v, VI order) {
    const D8 bytes;
    return hn::BitCast(DI(),
                       hn::TableLookupBytes(hn::BitCast(bytes, v), hn::BitCast(bytes, order)));
  }

  const std::int32_t* quads_;
  VI base_, steps_, fraction_, low_word_;
};

#else

class Sampler {
 public:
  HWY_INLINE Sampler(const std::int32_t* quads, VI base, int stride)
      : quads_(quads), base_(base), stride_(hn::Set(DI(), stride)) {}

  HWY_INLINE VI At(VI u, VI v) const {
    const DI d;
    const VI byte = hn::Set(d, 255);
    const VI row = hn::Mul(hn::ShiftRight<kFractionBits>(v), stride_);
    const VI index = hn::Add(base_, hn::Add(row, hn::ShiftRight<kFractionBits>(u)));
    const VI quad = hn::GatherIndex(d, quads_, index);
    const VI f = hn::And(hn::ShiftRight<8>(u), hn::Set(d, kAcross));
    const VI rest = hn::Sub(hn::Set(d, kAcross), f), g = hn::And(v, hn::Set(d, kDown));
    const VI top = hn::Add(hn::Mul(hn::And(quad, byte), rest),
                           hn::Mul(hn::And(hn::ShiftRight<8>(quad), byte), f));
    const VI bottom = hn::Add(hn::Mul(hn::And(hn::ShiftRight<16>(quad), byte), rest),
                              hn::Mul(hn::And(hn::ShiftRight<24>(quad), byte), f));
    return hn::Add(hn::Mul(top, hn::Sub(hn::Set(d, kDown), g)), hn::Mul(bottom, g));
  }

 private:
  const std::int32_t* quads_;
  VI base_, stride_;
};

#endif

}  // namespace dtr::stereo::patchmatch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
