#include "calib/bundle/rig_adjust.h"

#include <gtest/gtest.h>

#include <ceres/ceres.h>

#include "calib/bundle/observation_cost.h"
#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"

namespace dtr::calib {
namespace {

using namespace testing;

constexpr int kFrames = 8;
constexpr double kUnit = 3.7;  // rig units per unit of the model

// Two cameras side by side, the second turned a little, in the rig's unit.
KnownRig TwoCameras(const LensCamera& lens) {
  KnownRig rig;
  rig.lenses = {lens, lens};
  rig.lenses[1].params[0] *= 1.02;
  Pose second;
  second.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
  second.translation = second.rotation * Eigen::Vector3d(-0.9, 0.05, 0.02);
  rig.cam_from_rig = {Pose{}, second};
  return rig;
}

struct Scene {
  KnownRig rig;
  SfmModel model;  // noisy, in another unit, its cameras with one wrong lens
  std::map<std::string, RigPhoto> photo_of;
  std::vector<Pose> rig_from_world;  // truth, in the rig's unit
};

Scene MakeScene(double noise_px, std::uint64_t seed) {
  Scene scene;
  const LensCamera lens{CameraModel::kRadial, 1000, 800, {900, 504, 397, -0.05, 0.01}};
  scene.rig = TwoCameras(lens);
  Random random(seed);
  for (int f = 0; f < kFrames; ++f) {
    Pose rig = ArcPose(f, kFrames);
    rig.translation *= kUnit;
    scene.rig_from_world.push_back(rig);
    for (size_t c = 0; c < 2; ++c) {
      const Pose cam = scene.rig.cam_from_rig[c] * rig;
      SfmImage image;
      image.id = static_cast<std::uint32_t>(scene.model.images.size() + 1);
      image.name = std::string(c == 0 ? "left" : "right") + std::to_string(100 + f);
      image.camera_id = 7;
      image.cam_from_world = {cam.rotation, cam.translation / kUnit};
      scene.photo_of[image.name] = {c, std::to_string(f)};
      scene.model.images.push_back(image);
    }
  }
  scene.model.cameras[7] = lens;
  for (int p = 0; p < 300; ++p) {
    const Eigen::Vector3d place = BoxPoint(random);
    const auto id = static_cast<std::uint64_t>(p + 1);
    scene.model.points[id].p_in_world = place;
    for (SfmImage& image : scene.model.images) {
      const LensCamera& own = scene.rig.lenses[scene.photo_of[image.name].camera];
      const auto pixel = own.PixelFromCam(image.cam_from_world * place);
      const Eigen::Vector2d noise(random.Normal(), random.Normal());
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > 1000 || pixel->y() > 800)
        continue;
      image.features.push_back({*pixel + noise_px * noise, id});
    }
  }
  std::sort(scene.model.images.begin(), scene.model.images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return scene;
}

// As structure from motion leaves it: poses that are not rigid, in a world of its own.
void Disturb(SfmModel& model, std::uint64_t seed) {
  Random random(seed);
  for (SfmImage& image : model.images) {
    const Eigen::Vector3d turn(0.002 * random.Normal(), 0.002 * random.Normal(), 0);
    image.cam_from_world.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) *
        image.cam_from_world.rotation;
    image.cam_from_world.translation += 0.01 * Eigen::Vector3d(random.Normal(), random.Normal(), 0);
  }
}

TEST(RigMember, TheCamerasMotionIsThatOfTheRig) {
  const KnownRig rig = TwoCameras({CameraModel::kPinhole, 10, 10, {10, 10, 5, 5}});
  const Pose cam_from_rig = rig.cam_from_rig[1], start = ArcPose(2, 8);
  const RigMember member{cam_from_rig.rotation.toRotationMatrix(),
                         start.rotation.conjugate().toRotationMatrix(),
                         cam_from_rig.TargetOriginInSource()};
  const double rig_motion[6] = {0.3, -0.2, 0.5, 1.5, -0.7, 0.4};
  double motion[6];
  member.Motion(rig_motion, motion);
  const auto moved = [](const Pose& pose, const double* m) {
    const Eigen::Vector3d w(m[0], m[1], m[2]), v(m[3], m[4], m[5]);
    const Eigen::Quaterniond turned =
        Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized())) * pose.rotation;
    return Pose{turned, -(turned * (pose.TargetOriginInSource() + v))};
  };
  const Pose by_rig = cam_from_rig * moved(start, rig_motion);
  const Pose by_itself = moved(cam_from_rig * start, motion);
  EXPECT_LT(by_rig.rotation.angularDistance(by_itself.rotation), 1e-12);
  EXPECT_LT((by_rig.translation - by_itself.translation).norm(), 1e-12);
}

TEST(RefineRig, ExactObservationsGiveTheTruthInTheRigsUnit) {
  Scene scene = MakeScene(0, 1);
  Disturb(scene.model, 2);
  const RigRefined refined = RefineRig(scene.model, scene.rig, scene.photo_of);
  EXPECT_EQ(refined.frames, kFrames);
  EXPECT_LT(refined.adjusted.rms_px, 1e-6);
  for (const SfmImage& a : refined.model.images) {
    for (const SfmImage& b : refined.model.images) {
      const auto truth = [&](const SfmImage& image) {
        const RigPhoto& photo = scene.photo_of.at(image.name);
        return Eigen::Vector3d(
            (scene.rig.cam_from_rig[photo.camera] * scene.rig_from_world[std::stoul(photo.frame)])
                .TargetOriginInSource());
      };
      const double expected = (truth(a) - truth(b)).norm();
      const double found =
          (a.cam_from_world.TargetOriginInSource() - b.cam_from_world.TargetOriginInSource())
              .norm();
      EXPECT_NEAR(found, expected, 1e-6);
    }
  }
}

TEST(RefineRig, PlacesStayRigidUnderNoise) {
  Scene scene = MakeScene(0.5, 3);
  Disturb(scene.model, 4);
  const RigRefined refined = RefineRig(scene.model, scene.rig, scene.photo_of);
  EXPECT_NEAR(refined.adjusted.sigma_px, 0.5, 0.02);
  std::map<std::string, std::map<size_t, Pose>> frames;
  for (const SfmImage& image : refined.model.images) {
    const RigPhoto& photo = scene.photo_of.at(image.name);
    frames[photo.frame][photo.camera] = image.cam_from_world;
    EXPECT_EQ(refined.model.cameras.at(image.camera_id).params,
              scene.rig.lenses[photo.camera].params);
  }
  for (const auto& [frame, cameras] : frames) {
    const Pose place = cameras.at(1) * cameras.at(0).Inverse();
    EXPECT_LT((place.translation - scene.rig.cam_from_rig[1].translation).norm(), 1e-9) << frame;
    EXPECT_LT(place.rotation.angularDistance(scene.rig.cam_from_rig[1].rotation), 1e-9) << frame;
  }
  // The whole is as long as it is to 0.5 %: from 0.9 units between cameras 22 away from the scene.
  const auto span = [](const Pose& a, const Pose& b) {
    return (a.TargetOriginInSource() - b.TargetOriginInSource()).norm();
  };
  const double truth = span(scene.rig_from_world.front(), scene.rig_from_world.back());
  EXPECT_NEAR(span(frames["0"][0], frames["7"][0]), truth, 0.005 * truth);
}

TEST(RefineRig, WhatContradictsTheRigIsRejected) {
  const Scene scene = MakeScene(0.3, 5);
  KnownRig moved = scene.rig;
  moved.cam_from_rig[1].rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX())) *
      moved.cam_from_rig[1].rotation;
  EXPECT_THROW(RefineRig(scene.model, moved, scene.photo_of), Error);
  KnownRig together = scene.rig;
  together.cam_from_rig[1].translation.setZero();
  EXPECT_THROW(RefineRig(scene.model, together, scene.photo_of), Error);
  KnownRig other_size = scene.rig;
  other_size.lenses[0].width_px = 500;
  EXPECT_THROW(RefineRig(scene.model, other_size, scene.photo_of), Error);
  auto apart = scene.photo_of;
  for (auto& [name, photo] : apart) photo.frame = name;  // no time step that two cameras saw
  EXPECT_THROW(RefineRig(scene.model, scene.rig, apart), Error);
  auto unknown = scene.photo_of;
  unknown.erase("left100");
  EXPECT_THROW(RefineRig(scene.model, scene.rig, unknown), Error);
}

}  // namespace
}  // namespace dtr::calib
