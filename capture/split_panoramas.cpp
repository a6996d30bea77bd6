#include "capture/split_panoramas.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "capture/panorama_views.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;

constexpr int kViewJpegQuality = 98;
constexpr char kEquirectangular[] = "equirectangular";
constexpr double kSizeTolerance = 0.01;  // of an axis: stitchers round, programs shrink

bool Near(double a, double b) { return std::abs(a - b) <= kSizeTolerance * std::max(a, b); }

bool StatesPanorama(const Photo& photo) {
  return photo.panorama && photo.panorama->projection == kEquirectangular;
}

std::string FaceName(const PanoramaFace& face, const Photo& panorama) {
  return face.name + "/" + panorama.id + ".jpg";
}

// Screening of a panorama, as of one of its views.
std::optional<Screening> ScreeningOf(const Photo& panorama, const PanoramaFace& face,
                                     const std::map<std::string, const Photo*>& by_name) {
  std::optional<Screening> screening = panorama.screening;
  if (!screening || screening->duplicate_of.empty()) return screening;
  const auto original = by_name.find(screening->duplicate_of);
  screening->duplicate_of = original == by_name.end() ? "" : FaceName(face, *original->second);
  return screening;
}

Photo PhotoOfFace(const Photo& panorama, const PanoramaFace& face, int size_px) {
  Photo photo;
  photo.name = FaceName(face, panorama);
  photo.id = face.name + "_" + panorama.id;
  photo.width_px = photo.height_px = size_px;
  photo.focal_prior_px = FaceCamera(size_px).fx_px();
  photo.focal_source = "panorama";
  photo.camera_group = fmt::format("panorama|{}", size_px);
  photo.make = panorama.make;
  photo.model = panorama.model;
  photo.date_time = panorama.date_time;
  photo.gps = panorama.gps;
  photo.video_frame = panorama.video_frame;
  photo.face = {panorama.name, face.name};
  photo.source_sha256 = panorama.source_sha256;
  return photo;
}

// The views of one panorama, written; those without a usable pixel are listed in `left_out`.
std::vector<Photo> Split(const Photo& panorama, const std::vector<PanoramaFace>& faces, int size_px,
                         const fs::path& folder, std::vector<Skipped>& left_out) {
  const PhotoPixels pixels = ReadPhotoAndMask(panorama);
  const Panorama sphere = PanoramaOf(panorama);
  const PinholeCamera camera = FaceCamera(size_px);
  std::vector<Photo> photos;
  for (const PanoramaFace& face : faces) {
    const PanoramaView view =
        ViewOfPanorama(pixels.image, pixels.mask, sphere, camera, face.cam_from_panorama);
    Photo photo = PhotoOfFace(panorama, face, size_px);
    const auto& mask = view.mask.data();
    if (!mask.empty() && std::all_of(mask.begin(), mask.end(), [](auto m) { return m == 0; })) {
      left_out.push_back({photo.name, "the panorama has nothing to use there"});
      continue;
    }
    photo.file = folder / photo.name;
    io::WriteImage(photo.file, view.image, kViewJpegQuality);
    if (!mask.empty()) {
      photo.mask_file = folder / face.name / (panorama.id + "_mask.png");
      io::WriteMask(photo.mask_file, view.mask);
      photo.mask_sha256 = Sha256OfFile(photo.mask_file);
    }
    photos.push_back(std::move(photo));
  }
  return photos;
}

void RemarkOnPose(const Photo& panorama, Capture& capture) {
  const auto& stated = panorama.panorama;
  if (!stated || (stated->pitch_deg.value_or(0) == 0 && stated->roll_deg.value_or(0) == 0)) return;
  capture.remarks.push_back(
      {panorama.name,
       fmt::format("states that the camera was pitched by {:g} and rolled by {:g} degrees; its "
                   "rotation is found from the photos instead",
                   stated->pitch_deg.value_or(0), stated->roll_deg.value_or(0))});
}

void Announce(const Capture& panoramas, const Capture& views, size_t faces, int size_px,
              Progress& progress) {
  progress.Note(fmt::format("{} panoramas split into {} views of {} x {} px, {} each{}",
                            panoramas.photos.size(), views.photos.size(), size_px, size_px, faces,
                            views.photos.size() < faces * panoramas.photos.size()
                                ? "; those that masks cover whole are left out"
                                : ""));
}

}  // namespace

Panorama PanoramaOf(const Photo& photo) {
  const io::PanoramaXmp stated = photo.panorama.value_or(io::PanoramaXmp{});
  const double width = photo.width_px, height = photo.height_px;
  Panorama panorama{width, height, 0, 0};
  if (stated.full_width_px > 0 && stated.full_height_px > 0) {
    // Of the image as it was written; a program may have shrunk it since.
    const double given_width =
        stated.cropped_width_px > 0 ? stated.cropped_width_px : stated.full_width_px;
    const double given_height =
        stated.cropped_height_px > 0 ? stated.cropped_height_px : stated.full_height_px;
    const double x_scale = width / given_width, y_scale = height / given_height;
    if (!Near(x_scale, y_scale)) {
      throw Error(fmt::format(
          "{}: states a part of {:g} x {:g} px of a panorama, but has {} x {} px; it was cropped "
          "since, which leaves unknown where it looks: give the original",
          photo.name, given_width, given_height, photo.width_px, photo.height_px));
    }
    panorama = {x_scale * stated.full_width_px, y_scale * stated.full_height_px,
                x_scale * stated.left_px, y_scale * stated.top_px};
  }
  if (!Near(panorama.full_width_px, 2 * panorama.full_height_px)) {
    throw Error(fmt::format(
        "{}: an equirectangular panorama is twice as wide as high, this one {:.0f} x {:.0f} px; "
        "stereo panoramas hold two, give the upper half; other images: `panoramas` no",
        photo.name, panorama.full_width_px, panorama.full_height_px));
  }
  if (panorama.left_px + width > (1 + kSizeTolerance) * panorama.full_width_px ||
      panorama.top_px + height > (1 + kSizeTolerance) * panorama.full_height_px) {
    throw Error(photo.name + ": states a part of a panorama that lies beyond the whole");
  }
  return panorama;
}

namespace {

// A panorama or two among ordinary photos, or the reverse, are no reason to lose the others: leaves
// out the kind of which there are clearly fewer. False where there are not.
bool LeaveOutTheFew(Capture& capture, size_t panoramas, size_t others, Progress* progress) {
  const bool few_panoramas = 2 * panoramas < others, few_others = 2 * others < panoramas;
  if (!few_panoramas && !few_others) return false;
  for (const Photo& photo : capture.photos) {
    if (StatesPanorama(photo) != few_panoramas) continue;
    capture.skipped.push_back(
        {photo.name,
         few_panoramas ? "is a 360 degree panorama among ordinary photos; panoramas are a capture "
                         "of their own"
                       : "is no 360 degree panorama as the others are; ordinary photos are a "
                         "capture of their own"});
    if (progress == nullptr) continue;
    progress->Note("left out: " + photo.name + ": " + capture.skipped.back().reason);
  }
  std::erase_if(capture.photos,
                [&](const Photo& photo) { return StatesPanorama(photo) == few_panoramas; });
  std::sort(capture.skipped.begin(), capture.skipped.end(),
            [](const Skipped& a, const Skipped& b) { return a.name < b.name; });
  capture.contents.photos = static_cast<int>(capture.photos.size());
  return true;
}

}  // namespace

bool ArePanoramas(Capture& capture, PanoramaUse use, Progress* progress) {
  if (use == PanoramaUse::kNever) return false;
  const Photo *panorama = nullptr, *other = nullptr;
  std::vector<Remark> remarks;
  const Photo* wide = nullptr;
  int wide_count = 0;
  size_t panoramas = 0;
  for (const Photo& photo : capture.photos) {
    const bool is = !photo.face && (use == PanoramaUse::kAlways || StatesPanorama(photo));
    (is ? panorama : other) = &photo;
    panoramas += is;
    if (is || photo.face) continue;
    if (photo.panorama) {
      remarks.push_back({photo.name, fmt::format("states to be a panorama of the projection '{}', "
                                                 "which is not supported; taken as a photo",
                                                 photo.panorama->projection)});
    } else if (photo.width_px == 2 * photo.height_px) {
      if (wide_count++ == 0) wide = &photo;
    }
  }
  const size_t others = capture.photos.size() - panoramas;
  // Wide photos that state nothing may be panoramas, too.
  const bool others_are_wide = 2 * static_cast<size_t>(wide_count) >= others;
  if (panoramas > 0 && others > 0 && use == PanoramaUse::kAuto && !others_are_wide &&
      LeaveOutTheFew(capture, panoramas, others, progress)) {
    return ArePanoramas(capture, use, progress);
  }
  for (const Photo& photo : capture.photos) {
    if (!photo.face && (use == PanoramaUse::kAlways || StatesPanorama(photo))) {
      (void)PanoramaOf(photo);
    }
  }
  if (panorama != nullptr && other != nullptr) {
    throw Error(fmt::format(
        "{} is a 360 degree panorama, {} is none; panoramas and other photos cannot be one "
        "capture: give them in two folders{}",
        panorama->name, other->name,
        use == PanoramaUse::kAuto ? ", or `panoramas` yes where all are panoramas" : ""));
  }
  if (wide != nullptr) {
    remarks.push_back(
        {wide->name, fmt::format("{} photos are twice as wide as high and state no projection; "
                                 "if they are 360 degree panoramas, give `panoramas` yes",
                                 wide_count)});
  }
  capture.remarks.insert(capture.remarks.end(), remarks.begin(), remarks.end());
  return panorama != nullptr;
}

Capture SplitPanoramas(const Capture& capture, const fs::path& folder, Progress& progress) {
  const std::vector<PanoramaFace> faces = PanoramaFaces();
  double widest = 0;
  std::map<std::string, const Photo*> by_name;
  Capture views;
  views.skipped = capture.skipped;
  views.remarks = capture.remarks;
  views.contents = capture.contents;
  for (const Photo& panorama : capture.photos) {
    widest = std::max(widest, PanoramaOf(panorama).full_width_px);
    by_name[panorama.name] = &panorama;
    RemarkOnPose(panorama, views);
  }
  const int size_px = FaceSizePx(widest);
  for (const PanoramaFace& face : faces) fs::create_directories(folder / face.name);
  progress.Stage("splitting panoramas", static_cast<int>(capture.photos.size()));
  int done = 0;
  for (const Photo& panorama : capture.photos) {
    progress.ThrowIfInterrupted();
    for (Photo& photo : Split(panorama, faces, size_px, folder, views.skipped)) {
      photo.screening = ScreeningOf(panorama, FaceCalled(photo.face->face), by_name);
      views.photos.push_back(std::move(photo));
    }
    progress.Update(++done);
  }
  std::sort(views.photos.begin(), views.photos.end(),
            [](const Photo& a, const Photo& b) { return a.name < b.name; });
  views.contents.photos = static_cast<int>(views.photos.size());
  views.contents.cameras = 1;
  Announce(capture, views, faces.size(), size_px, progress);
  return views;
}

}  // namespace dtr::capture
