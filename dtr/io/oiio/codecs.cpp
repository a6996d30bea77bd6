// The only source that knows OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/tiffutils.h>

#include <mutex>
#include <system_error>

#include "dtr/io/image_codecs.h"

namespace dtr::io {
namespace {

using OIIO::ImageSpec;
using OIIO::TypeDesc;

// Our loops run over files, so OpenImageIO's own threads would only compete with them.
void SetUpOnce() {
  static std::once_flag once;
  std::call_once(once, [] {
    OIIO::attribute("exr_threads", -1);
    try {
      OIIO::attribute("threads", 1);
    } catch (const std::system_error&) {
      // It starts a thread that it does not use, and the system may have none left.
    }
  });
}

constexpr std::array<std::pair<Sample, TypeDesc::BASETYPE>, 5> kSamples{
    {{Sample::kUint8, TypeDesc::UINT8},
     {Sample::kUint16, TypeDesc::UINT16},
     {Sample::kHalf, TypeDesc::HALF},
     {Sample::kFloat, TypeDesc::FLOAT},
     {Sample::kDouble, TypeDesc::DOUBLE}}};

Sample SampleOf(TypeDesc type) {
  for (const auto& [sample, base] : kSamples) {
    if (type.basetype == base) return sample;
  }
  return Sample::kOther;
}

TypeDesc TypeOf(Sample sample) {
  for (const auto& [known, base] : kSamples) {
    if (sample == known) return TypeDesc(base);
  }
  return TypeDesc(TypeDesc::UNKNOWN);
}

class Facts : public ImageFacts {
 public:
  explicit Facts(const ImageSpec& spec) : spec_(spec) {
    x = spec.x;
    y = spec.y;
    width = spec.width;
    height = spec.height;
    depth = spec.depth;
    full_x = spec.full_x;
    full_y = spec.full_y;
    full_width = spec.full_width;
    full_height = spec.full_height;
    tile_width = spec.tile_width;
    tile_height = spec.tile_height;
    channels = spec.nchannels;
    alpha_channel = spec.alpha_channel;
    channel_names = spec.channelnames;
    sample = SampleOf(spec.format);
    sample_name = spec.format.c_str();
    sample_bytes = spec.format.size();
    pixel_bytes = spec.pixel_bytes(true);
  }

  int Int(const char* name, int without) const override {
    return spec_.get_int_attribute(name, without);
  }
  float Float(const char* name, float without) const override {
    return spec_.get_float_attribute(name, without);
  }
  std::string Text(const char* name) const override {
    return std::string(spec_.get_string_attribute(name));
  }
  std::vector<float> Floats(const char* name) const override {
    const OIIO::ParamValue* value = spec_.find_attribute(name);
    if (value == nullptr) return {};
    const bool rational = value->type().vecsemantics == TypeDesc::RATIONAL;  // two numbers each
    std::vector<float> floats(value->type().basevalues() / (rational ? 2 : 1));
    for (size_t i = 0; i < floats.size(); ++i) {
      floats[i] = value->get_float_indexed(static_cast<int>(i));
    }
    return floats;
  }
  std::vector<std::uint8_t> Bytes(const char* name) const override {
    const OIIO::ParamValue* value = spec_.find_attribute(name);
    if (value == nullptr || value->type().basetype != TypeDesc::UINT8) return {};
    const auto* bytes = static_cast<const std::uint8_t*>(value->data());
    return {bytes, bytes + value->datasize()};
  }

 private:
  const ImageSpec spec_;
};

class Opened : public OpenedImage {
 public:
  explicit Opened(std::unique_ptr<OIIO::ImageInput> in) : in_(std::move(in)), facts_(in_->spec()) {}
  ~Opened() override { (void)in_->geterror(); }  // else it is written to standard error

  const ImageFacts& facts() const override { return facts_; }
  std::string format() const override { return in_->format_name(); }
  std::unique_ptr<ImageFacts> FactsWith(const std::string& exif, bool upright) const override {
    ImageSpec spec = in_->spec();
    if (!exif.empty()) OIIO::decode_exif(OIIO::string_view(exif), spec);
    if (upright) spec.attribute("Orientation", 1);
    return std::make_unique<Facts>(spec);
  }
  bool Read(int first_channel, int end_channel, Sample sample, void* pixels,
            std::string& complaint) override {
    const bool read = in_->read_image(0, 0, first_channel, end_channel, TypeOf(sample), pixels);
    complaint = in_->geterror();
    return read;
  }
  bool HasSecondImage() override { return in_->seek_subimage(1, 0); }
  void Close() override { in_->close(); }

 private:
  const std::unique_ptr<OIIO::ImageInput> in_;
  const Facts facts_;
};

ImageSpec WishesFor(const std::optional<std::array<double, 3>>& raw_balance) {
  ImageSpec wishes;  // raw colours: alpha is dropped, not multiplied in
  wishes.attribute("oiio:UnassociatedAlpha", 1);
  // Of raw files: brightness as exposed, for neighbouring photos must show one surface alike.
  wishes.attribute("raw:auto_bright", 0);
  wishes.attribute("raw:adjust_maximum_thr", 0.0f);
  if (raw_balance) {
    const std::array<float, 4> factors{
        static_cast<float>((*raw_balance)[0]), static_cast<float>((*raw_balance)[1]),
        static_cast<float>((*raw_balance)[2]), static_cast<float>((*raw_balance)[1])};
    wishes.attribute("raw:use_camera_wb", 0);
    wishes.attribute("raw:user_mul", TypeDesc(TypeDesc::FLOAT, 4), factors.data());
  }
  return wishes;
}

ImageSpec SpecOf(const std::string& extension, const ImageToWrite& image) {
  ImageSpec spec(image.width, image.height, image.channels, TypeOf(image.sample));
  if (!image.channel_names.empty()) spec.channelnames = image.channel_names;
  for (const auto& [name, value] : image.attributes) {
    std::visit([&, &name = name](const auto& given) { spec.attribute(name, given); }, value);
  }
  // An EXR file would name it too, unless OpenImageIO has listed its formats by then.
  if (extension == ".png") spec.attribute("png:compressionLevel", kPngLevel);
  return spec;
}

class Oiio : public ImageCodecs {
 public:
  std::unique_ptr<OpenedImage> Open(const std::string& file,
                                    const std::optional<std::array<double, 3>>& raw_balance,
                                    std::string& complaint) const override {
    SetUpOnce();
    const ImageSpec wishes = WishesFor(raw_balance);
    auto in = OIIO::ImageInput::open(file, &wishes);
    if (in) return std::make_unique<Opened>(std::move(in));
    complaint = OIIO::geterror();
    return nullptr;
  }

  std::optional<std::string> Encode(const std::string& extension, const ImageToWrite& image,
                                    Sample sample, const void* pixels,
                                    std::string& complaint) const override {
    SetUpOnce();
    const std::string name = "memory" + extension;
    auto out = OIIO::ImageOutput::create(name);
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    if (out && out->set_ioproxy(&memory) && out->open(name, SpecOf(extension, image)) &&
        out->write_image(TypeOf(sample), pixels) && out->close()) {
      return std::string(bytes.begin(), bytes.end());
    }
    complaint = out ? out->geterror() : OIIO::geterror();
    return {};
  }

  std::string FormatList() const override { return OIIO::get_string_attribute("extension_list"); }
};

}  // namespace

const ImageCodecs& Codecs() {
  static const Oiio oiio;
  return oiio;
}

}  // namespace dtr::io
