#include "tests/support/hostile_images.h"

#include <array>

namespace dtr::testing {
namespace {

std::string Little(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 255);
  return text;
}

std::string Big(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes; i-- > 0;) text += static_cast<char>(value >> (8 * i) & 255);
  return text;
}

std::string Bytes(const std::vector<int>& values) {
  std::string text;
  for (const int value : values) text += static_cast<char>(value);
  return text;
}

std::string Zeros(size_t count) { return std::string(count, '\0'); }

std::string Webp(const std::string& tag, const std::string& data) {
  const std::string chunk = tag + Little(data.size(), 4) + data + Zeros(data.size() % 2);
  return "RIFF" + Little(4 + chunk.size(), 4) + "WEBP" + chunk;
}

std::string LosslessWebp(size_t padding) {
  return Webp("VP8L", "\x2f" + Little(16383 | 16383ULL << 14, 4) + Zeros(30 + padding));
}

std::string LossyWebp(size_t padding) {
  return Webp("VP8 ", Bytes({0x10, 2, 0, 0x9d, 1, 0x2a}) + Little(16383, 2) + Little(16383, 2) +
                          Zeros(600 + padding));
}

// A canvas of 16000x16000 with a frame of 8x8.
std::string AnimatedWebp(size_t padding) {
  const std::string frame = Webp("VP8L", "\x2f" + Little(7 | 7ULL << 14, 4) + Zeros(30 + padding));
  const std::string anmf = Zeros(6) + Little(7, 3) + Little(7, 3) + Zeros(4) + frame.substr(12);
  const std::string rest =
      "ANIM" + Little(6, 4) + Zeros(6) + "ANMF" + Little(anmf.size(), 4) + anmf;
  const std::string head = Little(2, 4) + Little(15999, 3) + Little(15999, 3);
  const std::string chunks = "VP8X" + Little(10, 4) + head + rest;
  return "RIFF" + Little(4 + chunks.size(), 4) + "WEBP" + chunks;
}

std::string Psd(int version, std::uint32_t side, int channels, int bits, int packing,
                size_t padding) {
  return "8BPS" + Big(static_cast<std::uint64_t>(version), 2) + Zeros(6) +
         Big(static_cast<std::uint64_t>(channels), 2) + Big(side, 4) + Big(side, 4) +
         Big(static_cast<std::uint64_t>(bits), 2) + Big(3, 2) + Zeros(8) +
         Zeros(version == 1 ? 4 : 8) + Big(static_cast<std::uint64_t>(packing), 2) +
         Zeros(64 + padding);
}

struct TiffKind {
  std::uint32_t width = 20000, height = 20000;
  int channels = 3, bits = 8, packing = 1, tile = 0;
  bool floats = false;
};

std::string Tiff(const TiffKind& kind, size_t padding) {
  const std::string data = Zeros(100 + padding + padding % 2);
  std::vector<std::array<std::uint64_t, 3>> tags{{256, 4, kind.width},
                                                 {257, 4, kind.height},
                                                 {258, 3, static_cast<std::uint64_t>(kind.bits)},
                                                 {259, 3, static_cast<std::uint64_t>(kind.packing)},
                                                 {262, 3, kind.channels >= 3 ? 2u : 1u}};
  if (kind.tile == 0) tags.push_back({273, 4, 8});
  tags.push_back({277, 3, static_cast<std::uint64_t>(kind.channels)});
  if (kind.tile == 0) {
    tags.push_back({278, 4, kind.height});
    tags.push_back({279, 4, data.size()});
  }
  tags.push_back({284, 3, 1});
  if (kind.tile != 0) {
    const auto side = static_cast<std::uint64_t>(kind.tile);
    tags.insert(tags.end(), {{322, 4, side}, {323, 4, side}, {324, 4, 8}, {325, 4, data.size()}});
  }
  tags.push_back({339, 3, kind.floats ? 3u : 1u});
  std::string directory = Little(tags.size(), 2);
  for (const auto& [tag, type, value] : tags) {
    directory += Little(tag, 2) + Little(type, 2) + Little(1, 4) + Little(value, 4);
  }
  return "II*" + Zeros(1) + Little(8 + data.size(), 4) + data + directory + Zeros(4);
}

std::string Bmp(std::uint64_t width, std::int64_t height, int bits, int packing, size_t padding) {
  return "BM" + Little(1000, 4) + Zeros(4) + Little(54, 4) + Little(40, 4) + Little(width, 4) +
         Little(static_cast<std::uint64_t>(height), 4) + Little(1, 2) +
         Little(static_cast<std::uint64_t>(bits), 2) +
         Little(static_cast<std::uint64_t>(packing), 4) + Zeros(20) + Zeros(1100 + padding);
}

std::string Codestream(std::uint32_t side, int channels, std::uint32_t tile, size_t padding) {
  std::string size = Zeros(2) + Big(side, 4) + Big(side, 4) + Zeros(8) + Big(tile, 4) +
                     Big(tile, 4) + Zeros(8) + Big(static_cast<std::uint64_t>(channels), 2);
  for (int c = 0; c < channels; ++c) size += Bytes({7, 1, 1});
  const std::string coding = Bytes({0, 0, 0, 1, 0, 5, 4, 4, 0, 1});
  const std::string steps = Bytes({0x20}) + std::string(16, 72);
  const std::string data = Zeros(50 + padding);
  return Bytes({0xff, 0x4f, 0xff, 0x51}) + Big(size.size() + 2, 2) + size + Bytes({0xff, 0x52}) +
         Big(coding.size() + 2, 2) + coding + Bytes({0xff, 0x5c}) + Big(steps.size() + 2, 2) +
         steps + Bytes({0xff, 0x90}) + Big(10, 2) + Zeros(2) + Big(14 + data.size(), 4) +
         Bytes({0, 1, 0xff, 0x93}) + data + Bytes({0xff, 0xd9});
}

std::string Box(const std::string& type, const std::string& content) {
  return Big(8 + content.size(), 4) + type + content;
}

std::string Jp2(size_t padding) {
  constexpr std::uint32_t kSide = 20000;
  return Box("jP  ", "\r\n\x87\n") + Box("ftyp", "jp2 " + Zeros(4) + "jp2 ") +
         Box("jp2h", Box("ihdr", Big(kSide, 4) + Big(kSide, 4) + Big(3, 2) + Bytes({7, 7, 0, 0})) +
                         Box("colr", Bytes({1, 0, 0}) + Big(16, 4))) +
         Box("jp2c", Codestream(kSide, 3, kSide, padding));
}

/// `type`: of the item; `payload`: its bytes; `extent`: what its `ispe` states.
std::string Heif(const std::string& brand, const std::string& type, const std::string& config,
                 std::uint32_t extent, const std::string& payload) {
  const std::string properties =
      Box("iprp", Box("ipco", config + Box("ispe", Zeros(4) + Big(extent, 4) + Big(extent, 4))) +
                      Box("ipma", Zeros(4) + Big(1, 4) + Big(1, 2) +
                                      (config.empty() ? Bytes({1, 1}) : Bytes({2, 0x81, 2}))));
  const auto meta = [&](std::uint64_t offset) {
    const std::string location = Zeros(4) + Bytes({0x44, 0}) + Big(1, 2) + Big(1, 2) + Zeros(2) +
                                 Big(1, 2) + Big(offset, 4) + Big(payload.size(), 4);
    return Box("meta", Zeros(4) + Box("hdlr", Zeros(8) + "pict" + Zeros(13)) +
                           Box("pitm", Zeros(4) + Big(1, 2)) + Box("iloc", location) +
                           Box("iinf", Zeros(4) + Big(1, 2) +
                                           Box("infe", Bytes({2, 0, 0, 0}) + Big(1, 2) + Zeros(2) +
                                                           type + Zeros(1))) +
                           properties);
  };
  const std::string start = Box("ftyp", brand + Zeros(4) + "mif1" + brand);
  return start + meta(start.size() + meta(0).size() + 8) + Box("mdat", payload);
}

std::string Heic(std::uint32_t extent, size_t padding) {
  const std::string config =
      Box("hvcC", Bytes({1,    1,   0x60, 0,    0,    0,    0x90, 0, 0, 0,   0, 0,
                         0x78, 240, 0,    0xfc, 0xfd, 0xf8, 0xf8, 0, 0, 0xf, 0}));
  return Heif("heic", "hvc1", config, extent, Zeros(64 + padding));
}

// Its tiles are absent; the canvas is stated by the item alone.
std::string HeicGrid() {
  return Heif("heic", "grid", "", 8, Bytes({0, 1, 7, 7}) + Big(30000, 4) + Big(30000, 4));
}

std::string Dpx(std::uint32_t width, std::uint32_t height, size_t padding) {
  std::string text = "SDPX" + Big(2048, 4) + "V1.0" + Zeros(4) + Big(3000, 4) + Zeros(4) +
                     Big(1664, 4) + Big(384, 4);
  text.resize(768, '\0');
  text += Big(0, 2) + Big(1, 2) + Big(width, 4) + Big(height, 4);
  text += Zeros(20) + Bytes({50, 2, 2, 10}) + Big(1, 2) + Big(0, 2) + Big(2048, 4);
  text.resize(2048, '\0');
  return text + Zeros(100 + padding);
}

std::string Tga(int kind, int bits, size_t padding) {
  return Bytes({0, 0, kind, 0, 0, 0, 0, 0}) + Zeros(4) + Little(20000, 2) + Little(20000, 2) +
         Bytes({bits, 0}) + Zeros(100 + padding);
}

// Checksums are wrong: libpng looks at those of the header and stops; so `crc` gives them.
std::string PngChunk(const std::string& type, const std::string& data) {
  std::uint32_t crc = 0xffffffff;
  for (const char c : type + data) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
  }
  return Big(data.size(), 4) + type + data + Big(crc ^ 0xffffffff, 4);
}

std::string Png(int bits, int colour_type, bool interlaced, size_t padding) {
  const std::string header = Big(20000, 4) + Big(20000, 4) + Bytes({bits, colour_type, 0, 0}) +
                             Bytes({interlaced ? 1 : 0});
  return "\x89PNG\r\n\x1a\n" + PngChunk("IHDR", header) +
         PngChunk("IDAT", "\x78\x9c" + Zeros(20 + padding)) + PngChunk("IEND", "");
}

std::string Jpeg(int frame, int sampling, bool several_scans, size_t padding) {
  std::string text = Bytes({0xff, 0xd8, 0xff, 0xdb}) + Big(67, 2) + Zeros(1) + std::string(64, 1);
  text += Bytes({0xff, frame}) + Big(17, 2) + Bytes({8}) + Big(19000, 2) + Big(19000, 2) +
          Bytes({3, 1, sampling, 0, 2, 0x11, 0, 3, 0x11, 0});
  for (const int table : {0, 0x10}) {
    text += Bytes({0xff, 0xc4}) + Big(20, 2) + Bytes({table, 1}) + Zeros(15) + Zeros(1);
  }
  text += Bytes({0xff, 0xda}) + (several_scans ? Big(8, 2) + Bytes({1, 1, 0, 0})
                                               : Big(12, 2) + Bytes({3, 1, 0, 2, 0, 3, 0, 0}));
  return text + Bytes({frame == 0xc2 ? 0 : 63, 0}) + Zeros(100 + padding) + Bytes({0xff, 0xd9});
}

}  // namespace

std::string HostileGif(int width, int height, bool frame) {
  const auto side = [](int px) { return Little(static_cast<std::uint64_t>(px), 2); };
  return "GIF89a" + side(width) + side(height) + Bytes({0x80, 0, 0, 0, 0, 0, 255, 255, 255}) + "," +
         Zeros(4) + side(frame ? width : 1) + side(frame ? height : 1) + Zeros(1) +
         Bytes({2, 2, 0x4c, 1, 0}) + ";";
}

std::vector<std::pair<std::string, std::string>> HostileImages(size_t padding) {
  const std::string zeros = Zeros(100 + padding);
  const std::string radiance = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 19000 +X 19000\n";
  return {
      {"lossless.webp", LosslessWebp(padding)},
      {"lossy.webp", LossyWebp(padding)},
      {"animated.webp", AnimatedWebp(padding)},
      {"plain.psd", Psd(1, 20000, 3, 8, 0, padding)},
      {"packed.psd", Psd(1, 20000, 3, 8, 1, padding)},
      {"large.psb", Psd(2, 300000, 3, 8, 1, padding)},
      {"float.psd", Psd(1, 20000, 56, 32, 0, padding)},
      {"strip.tif", Tiff({}, padding)},
      {"lzw.tif", Tiff({.packing = 5}, padding)},
      {"deflate.tif", Tiff({.packing = 8}, padding)},
      {"packbits.tif", Tiff({.packing = 32773}, padding)},
      {"jpeg.tif", Tiff({.packing = 7}, padding)},
      {"fax.tif", Tiff({.channels = 1, .bits = 1, .packing = 4}, padding)},
      {"float.tif", Tiff({.bits = 32, .floats = true}, padding)},
      {"channels.tif", Tiff({.channels = 1000}, padding)},
      {"tile.tif", Tiff({.width = 16384, .height = 16384, .tile = 16384}, padding)},
      {"largetile.tif", Tiff({.width = 64, .height = 64, .packing = 8, .tile = 30000}, padding)},
      {"plain.bmp", Bmp(20000, 20000, 24, 0, padding)},
      {"packed.bmp", Bmp(20000, 20000, 8, 1, padding)},
      {"topdown.bmp", Bmp(20000, -20000, 24, 0, padding)},
      {"wide.bmp", Bmp(0x7fffffff, 1, 24, 0, padding)},
      {"image.jp2", Jp2(padding)},
      {"bare.j2c", Codestream(20000, 3, 20000, padding)},
      {"tiles.j2c", Codestream(20000, 3, 256, padding)},
      {"channels.j2c", Codestream(4000, 255, 4000, padding)},
      {"photo.heic", Heic(30000, padding)},
      {"smaller.heic", Heic(16000, padding)},
      {"grid.heic", HeicGrid()},
      {"photo.avif", Heif("avif", "av01", Box("av1C", Bytes({0x81, 0, 0, 0})), 20000, zeros)},
      {"radiance.hdr", radiance + zeros},
      {"plain.ppm", "P6\n20000 20000\n255\n" + zeros},
      {"text.ppm", "P3\n20000 20000\n255\n0 0 0"},
      {"bits.pbm", "P4\n20000 20000\n" + zeros},
      {"float.pfm", "PF\n20000 20000\n-1.0\n" + zeros},
      {"film.dpx", Dpx(20000, 20000, padding)},
      {"wide.dpx", Dpx(1000000000, 4, padding)},
      {"plain.tga", Tga(2, 24, padding)},
      {"packed.tga", Tga(10, 32, padding)},
      {"plain.png", Png(8, 2, false, padding)},
      {"interlaced.png", Png(8, 2, true, padding)},
      {"deep.png", Png(16, 6, true, padding)},
      {"baseline.jpg", Jpeg(0xc0, 0x22, false, padding)},
      {"scans.jpg", Jpeg(0xc0, 0x22, true, padding)},
      {"subsampled.jpg", Jpeg(0xc2, 0x22, false, padding)},
      {"progressive.jpg", Jpeg(0xc2, 0x11, false, padding)}};
}

}  // namespace dtr::testing
