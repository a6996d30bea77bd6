// tests/pipeline/source_writer.h -- the files of other programs, with a reader's fault where asked.
#pragma once
#include <fmt/format.h>

#include "dtr/base/files.h"
#include "tests/pipeline/source_projections.h"

namespace dtr::testing {

namespace fs = std::filesystem;

inline std::string Row(const Matrix3d& m) {
  std::string text;
  for (int i = 0; i < 9; ++i) text += fmt::format("{}{}", i > 0 ? " " : "", m(i / 3, i % 3));
  return text;
}

// The file is written with the fault; `project` stays what the program would say.
struct Writer {
  const TrueCapture& capture;
  fs::path folder;
  Fault fault;
  std::vector<SourceProgram> programs = {};

  // Faults of the intrinsics, which the writers of a format then write.
  Terms Faulty(Terms t) const {
    if (fault == Fault::kHalfPixel) {
      t.cx += 0.5;
      t.cy += 0.5;
    }
    if (fault == Fault::kSwappedTangential) std::swap(t.p1, t.p2);
    return t;
  }
  Matrix3d Rotation(const TrueCamera& camera) const {
    if (fault != Fault::kFlippedAxis) return camera.rotation;
    return Vector3d(1, -1, -1).asDiagonal() * camera.rotation;
  }

  fs::path Add(const std::string& format, const std::string& variant, const std::string& name,
               const std::string& text, Projection project, bool points = false) {
    const fs::path file = folder / (format + "_" + variant) / name;
    fs::create_directories(file.parent_path());
    WriteFileAtomically(file, text);
    programs.push_back({format, variant, file, std::move(project), points});
    return file;
  }

  void Metashape(const std::string& variant, Terms t, bool fisheye, const std::string& component,
                 const std::string& chunk, const Matrix3d& r, const Vector3d& shift, double scale) {
    const Projection project = MetashapeProjection(t, fisheye);
    t = Faulty(t);
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\">\n <chunk "
        "label=\"Chunk 1\" enabled=\"true\">\n  <sensors next_id=\"1\">\n";
    text += fmt::format(
        "   <sensor id=\"0\" label=\"x\" type=\"{0}\">\n    <resolution width=\"{1}\" "
        "height=\"{2}\"/>\n    <calibration type=\"{0}\" class=\"initial\"><resolution "
        "width=\"{1}\" height=\"{2}\"/><f>1</f></calibration>\n    <calibration type=\"{0}\" "
        "class=\"adjusted\"><resolution width=\"{1}\" height=\"{2}\"/>\n",
        fisheye ? "fisheye" : "frame", kW, kH);
    const auto put = [&](const char* name, double value) {
      if (value != 0) text += fmt::format("     <{0}>{1}</{0}>\n", name, value);
    };
    put("f", t.f);
    put("cx", t.cx - kW / 2);
    put("cy", t.cy - kH / 2);
    put("b1", t.b1);
    put("b2", t.b2);
    for (int i = 0; i < 4; ++i) put(fmt::format("k{}", i + 1).c_str(), t.k[i]);
    put("p1", t.p1);
    put("p2", t.p2);
    put("p3", t.p3);
    put("p4", t.p4);
    text += "    </calibration>\n   </sensor>\n  </sensors>\n" + component +
            "  <cameras next_id=\"9\" next_group_id=\"1\">\n   <group id=\"0\" label=\"g\">\n";
    for (size_t i = 0; i < capture.cameras.size(); ++i) {
      const TrueCamera& camera = capture.cameras[i];
      // world = scale r chunk + shift
      const Matrix3d axes = r.transpose() * Rotation(camera).transpose();
      const Vector3d centre = r.transpose() * (camera.centre - shift) / scale;
      std::string label = camera.name;
      if (i % 2 == 0) label = fs::path(label).replace_extension().string();
      text += fmt::format(
          "    <camera id=\"{}\" sensor_id=\"0\" component_id=\"0\" "
          "label=\"{}\"><transform>",
          i, label);
      for (int row = 0; row < 3; ++row) {
        text += fmt::format("{} {} {} {} ", axes(row, 0), axes(row, 1), axes(row, 2), centre[row]);
      }
      text += "0 0 0 1</transform></camera>\n";
    }
    text +=
        "    <camera id=\"7\" sensor_id=\"0\" label=\"off.jpg\" enabled=\"false\"><transform>1 0 0 "
        "0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera>\n    <camera id=\"8\" sensor_id=\"0\" "
        "label=\"lost.jpg\"/>\n   </group>\n  </cameras>\n" +
        chunk + " </chunk>\n</document>\n";
    Add("metashape", variant, "cameras.xml", text, project);
  }

  void RealityScan(bool newer) {
    Terms t = Brown();
    t.k[3] = 0.004;
    const Projection project = RealityScanProjection(t);
    t = Faulty(t);
    std::string text =
        newer ? "#name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1,k2,k3,k4,t1,t2\n"
              : "#cameras 5\n#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n";
    for (const TrueCamera& camera : capture.cameras) {
      // A camera with heading, pitch and roll 0 looks down, its top to the north: in OpenGL's axes
      // it is the world's. R = Rz(-heading) Rx(pitch) Ry(roll).
      const Matrix3d gl = Rotation(camera).transpose() * Vector3d(1, -1, -1).asDiagonal();
      const double pitch = std::asin(gl(2, 1));
      const double roll = std::atan2(-gl(2, 0), gl(2, 2));
      const double heading = -std::atan2(-gl(0, 1), gl(1, 1));
      const double deg = 180 / std::numbers::pi;
      text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", camera.name,
                          camera.centre.x(), camera.centre.y(), camera.centre.z(), heading * deg,
                          pitch * deg, roll * deg, t.f * 36 / kW, (t.cx - kW / 2) / kW,
                          (t.cy - kH / 2) / kW, t.k[0], t.k[1], t.k[2], t.k[3], t.p1, t.p2);
    }
    Add("realityscan", newer ? "newer" : "older", "export.csv", text, project);
  }

  void RealityScanOpenCv() {
    Terms t = Brown();
    const Projection project = RealityScanProjection(t);
    t = Faulty(t);
    std::string text =
        "#name,tx,ty,tz,R00,R01,R02,R10,R11,R12,R20,R21,R22,f_pix,px_pix,py_pix,k1,k2,t2,t1,k3,"
        "k4\n";
    for (const TrueCamera& camera : capture.cameras) {
      const Matrix3d r = Rotation(camera);
      const Vector3d shift = -r * camera.centre;
      text += fmt::format("{},{},{},{}", camera.name, shift.x(), shift.y(), shift.z());
      for (int i = 0; i < 9; ++i) text += fmt::format(",{}", r(i / 3, i % 3));
      text += fmt::format(",{},{},{},{},{},{},{},{},{}\n", t.f, t.cx, t.cy, t.k[0], t.k[1], t.p2,
                          t.p1, t.k[2], 0);
    }
    Add("realityscan", "opencv", "cameras_opencv.csv", text, project);
  }

  void OpenSfm(const std::string& type, Terms t, Projection project, bool tracks) {
    t = Faulty(t);
    const double side = std::max(kW, kH);
    std::string camera = fmt::format(
        R"("v2 x": {{"projection_type": "{}", "width": {}, "height": {})", type, kW, kH);
    if (type == "perspective" || type == "fisheye") {
      camera += fmt::format(R"(, "focal": {}, "k1": {}, "k2": {})", t.f / side, t.k[0], t.k[1]);
    } else {
      camera += fmt::format(
          R"(, "focal_x": {}, "focal_y": {}, "c_x": {}, "c_y": {}, "k1": {}, "k2": {}, "k3": {}, "k4": {}, "k5": {}, "k6": {}, "p1": {}, "p2": {})",
          t.f / side, t.fy / side, (t.cx - kW / 2) / side, (t.cy - kH / 2) / side, t.k[0], t.k[1],
          t.k[2], t.k[3], t.k[4], t.k[5], t.p1, t.p2);
    }
    std::string shots, points, rows = "OPENSFM_TRACKS_VERSION_v2\n";
    for (const TrueCamera& c : capture.cameras) {
      const Eigen::AngleAxisd turn(Rotation(c));
      const Vector3d axis = turn.axis() * turn.angle(), shift = -Rotation(c) * c.centre;
      shots += fmt::format(
          R"({}"{}": {{"rotation": [{}, {}, {}], "translation": [{}, {}, {}], "camera": "v2 x", "orientation": 1}})",
          shots.empty() ? "" : ", ", c.name, axis.x(), axis.y(), axis.z(), shift.x(), shift.y(),
          shift.z());
      for (size_t i = 0; i < capture.points.size(); ++i) {
        const Vector2d pixel = project(c.InCamera(capture.points[i]));
        rows += fmt::format("{}\t{}\t{}\t{}\t{}\t0.004\t10\t20\t30\t-1\t-1\n", c.name, i, i,
                            (pixel.x() - kW / 2) / side, (pixel.y() - kH / 2) / side);
      }
    }
    for (size_t i = 0; i < capture.points.size(); ++i) {
      const Vector3d& p = capture.points[i];
      points += fmt::format(R"({}"{}": {{"color": [10, 20, 30], "coordinates": [{}, {}, {}]}})",
                            i > 0 ? ", " : "", i, p.x(), p.y(), p.z());
    }
    const std::string text =
        "[{\"cameras\": {" + camera + "}}, \"shots\": {" + shots + "}, \"points\": {" + points +
        "}, \"reference_lla\": {\"latitude\": 48.1, \"longitude\": 11.5, "
        "\"altitude\": 500}}, {\"cameras\": {}, \"shots\": {}, \"points\": {}}]\n";
    const fs::path file = Add("opensfm", type, "reconstruction.json", text, project, tracks);
    if (tracks) WriteFileAtomically(file.parent_path() / "tracks.csv", rows);
  }

  void Bundler() {
    Terms t;
    t.cx = kW / 2;
    t.cy = kH / 2;
    t.k[0] = -0.11;
    t.k[1] = 0.05;
    // P = R X + t, p = -P / P.z, p' = f r(p) p, y up from the image's middle.
    const Projection project = OpenCvProjection(t);
    std::string text = fmt::format("# Bundle file v0.3\n{} {}\n", capture.cameras.size() + 1,
                                   capture.points.size());
    std::string list;
    for (const TrueCamera& c : capture.cameras) {
      const Matrix3d r = Vector3d(1, -1, -1).asDiagonal() * Rotation(c);
      const Vector3d shift = -r * c.centre;
      text += fmt::format("{} {} {}\n", t.f, t.k[0], t.k[1]);
      for (int i = 0; i < 3; ++i) text += fmt::format("{} {} {}\n", r(i, 0), r(i, 1), r(i, 2));
      text += fmt::format("{} {} {}\n", shift.x(), shift.y(), shift.z());
      list += "/somewhere/else/" + c.name + " 0 500\n";
    }
    text += "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n";
    list += "failed.jpg\n";
    for (const Vector3d& p : capture.points) {
      text += fmt::format("{} {} {}\n10 20 30\n{}", p.x(), p.y(), p.z(), capture.cameras.size());
      for (size_t i = 0; i < capture.cameras.size(); ++i) {
        const Vector2d pixel = project(capture.cameras[i].InCamera(p));
        text += fmt::format(" {} 7 {} {}", i, pixel.x() - kW / 2, kH / 2 - pixel.y());
      }
      text += "\n";
    }
    const fs::path file = Add("bundler", "v0.3", "bundle.out", text, project, true);
    WriteFileAtomically(file.parent_path() / "list.txt", list);
  }

  void Nvm(const std::string& variant, double r, bool matrices) {
    const double f = 500;
    const Projection project = VisualSfmProjection(f, r);
    std::string text =
        fmt::format("NVM_V3{}\n\n{}\n", matrices ? "_R9T" : " ", capture.cameras.size());
    for (const TrueCamera& c : capture.cameras) {
      const Eigen::Quaterniond q(Rotation(c));
      const Vector3d shift = -Rotation(c) * c.centre;
      text += c.name + fmt::format("\t{} ", f);
      text += matrices
                  ? Row(Rotation(c)) + fmt::format(" {} {} {} ", shift.x(), shift.y(), shift.z())
                  : fmt::format("{} {} {} {} {} {} {} ", q.w(), q.x(), q.y(), q.z(), c.centre.x(),
                                c.centre.y(), c.centre.z());
      text += fmt::format("{} 0 \n", r);
    }
    text += fmt::format("\n{}\n", capture.points.size());
    for (const Vector3d& p : capture.points) {
      text += fmt::format("{} {} {} 10 20 30 {}", p.x(), p.y(), p.z(), capture.cameras.size());
      for (size_t i = 0; i < capture.cameras.size(); ++i) {
        const Vector2d pixel = project(capture.cameras[i].InCamera(p));
        text += fmt::format(" {} 3 {} {}", i, pixel.x() - kW / 2, pixel.y() - kH / 2);
      }
      text += " \n";
    }
    text += "\n0\n\n#the last part of NVM file points to the PLY files\n";
    Add("nvm", variant, "model.nvm", text, project, true);
  }

  // OpenMVG and AliceVision count pixels from the centre of the first one.
  void OpenMvg(const std::string& type, Terms t, Projection project) {
    t = Faulty(t);
    std::string views, extrinsics, structure;
    for (size_t i = 0; i < capture.cameras.size(); ++i) {
      const TrueCamera& c = capture.cameras[i];
      const Matrix3d r = Rotation(c);
      const char* comma = i > 0 ? ", " : "";
      views += fmt::format(
          R"({}{{"key": {}, "value": {{"polymorphic_id": 1073741824, "ptr_wrapper": {{"id": {}, "data": {{"local_path": "", "filename": "{}", "width": {}, "height": {}, "id_view": {}, "id_intrinsic": 0, "id_pose": {}}}}}}}}})",
          comma, i, 2147483649u + i, c.name, kW, kH, i, i);
      extrinsics += fmt::format(
          R"({}{{"key": {}, "value": {{"rotation": [[{}, {}, {}], [{}, {}, {}], [{}, {}, {}]], "center": [{}, {}, {}]}}}})",
          comma, i, r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2),
          c.centre.x(), c.centre.y(), c.centre.z());
    }
    views += fmt::format(
        R"(, {{"key": 99, "value": {{"polymorphic_id": 1073741824, "ptr_wrapper": {{"id": 2147483748, "data": {{"local_path": "", "filename": "lost.jpg", "width": {}, "height": {}, "id_view": 99, "id_intrinsic": 0, "id_pose": 99}}}}}}}})",
        kW, kH);
    for (size_t j = 0; j < capture.points.size(); ++j) {
      const Vector3d& p = capture.points[j];
      structure += fmt::format(R"({}{{"key": {}, "value": {{"X": [{}, {}, {}], "observations": [)",
                               j > 0 ? ", " : "", j, p.x(), p.y(), p.z());
      for (size_t i = 0; i < capture.cameras.size(); ++i) {
        const Vector2d pixel = project(capture.cameras[i].InCamera(p));
        structure += fmt::format(R"({}{{"key": {}, "value": {{"id_feat": 0, "x": [{}, {}]}}}})",
                                 i > 0 ? ", " : "", i, pixel.x() - 0.5, pixel.y() - 0.5);
      }
      structure += "]}}";
    }
    const std::string base =
        fmt::format(R"("width": {}, "height": {}, "focal_length": {}, "principal_point": [{}, {}])",
                    kW, kH, t.f, t.cx - 0.5, t.cy - 0.5);
    std::string data = base;
    if (type == "pinhole_radial_k1") data += fmt::format(R"(, "disto_k1": [{}])", t.k[0]);
    if (type == "pinhole_radial_k3") {  // as version 1 wrote it
      data = fmt::format(R"("value0": {{{}}}, "disto_k3": [{}, {}, {}])", base, t.k[0], t.k[1],
                         t.k[2]);
    }
    if (type == "pinhole_brown_t2") {
      data +=
          fmt::format(R"(, "disto_t2": [{}, {}, {}, {}, {}])", t.k[0], t.k[1], t.k[2], t.p1, t.p2);
    }
    if (type == "fisheye") {
      data += fmt::format(R"(, "fisheye": [{}, {}, {}, {}])", t.k[0], t.k[1], t.k[2], t.k[3]);
    }
    const std::string text = fmt::format(
        R"({{"sfm_data_version": "0.3", "root_path": "/x", "views": [{}], "intrinsics": [{{"key": 0, "value": {{"polymorphic_id": 2147483649, "polymorphic_name": "{}", "ptr_wrapper": {{"id": 2147483700, "data": {{{}}}}}}}}}], "extrinsics": [{}], "structure": [{}], "control_points": []}})"
        "\n",
        views, type, data, extrinsics, structure);
    Add("openmvg", type, "sfm_data.json", text, project, true);
  }

  void AliceVision(const std::string& type, const std::string& version, Terms t,
                   Projection project) {
    t = Faulty(t);
    const bool pixels = version == "0", newest = version == "11";
    std::string views, poses, structure, distortion;
    for (size_t i = 0; i < capture.cameras.size(); ++i) {
      const TrueCamera& c = capture.cameras[i];
      const Matrix3d r = Rotation(c);
      const char* comma = i > 0 ? ", " : "";
      views += fmt::format(
          R"({}{{"viewId": "{}", "poseId": "{}", "intrinsicId": "77", "path": "C:/photos/{}", "width": "{}", "height": "{}", "metadata": ""}})",
          comma, 1000 + i, 2000 + i, c.name, kW, kH);
      poses += fmt::format(R"({}{{"poseId": "{}", "pose": {{"transform": {{"rotation": [)", comma,
                           2000 + i);
      for (int j = 0; j < 9; ++j) {  // column by column
        poses += fmt::format("{}\"{}\"", j > 0 ? ", " : "", r(j % 3, j / 3));
      }
      poses += fmt::format(R"(], "center": ["{}", "{}", "{}"]}}, "locked": "1"}}}})", c.centre.x(),
                           c.centre.y(), c.centre.z());
    }
    views +=
        R"(, {"viewId": "9", "poseId": "9", "intrinsicId": "77", "path": "C:/photos/lost.jpg"})";
    for (size_t j = 0; j < capture.points.size(); ++j) {
      const Vector3d& p = capture.points[j];
      structure += fmt::format(
          R"({}{{"landmarkId": "{}", "descType": "sift", "color": ["10", "20", "30"], "X": ["{}", "{}", "{}"], "observations": [)",
          j > 0 ? ", " : "", j, p.x(), p.y(), p.z());
      for (size_t i = 0; i < capture.cameras.size(); ++i) {
        const Vector2d pixel = project(capture.cameras[i].InCamera(p));
        structure += fmt::format(
            R"({}{{"observationId": "{}", "featureId": "0", "x": ["{}", "{}"], "scale": "1"}})",
            i > 0 ? ", " : "", 1000 + i, pixel.x() - 0.5, pixel.y() - 0.5);
      }
      structure += "]}";
    }
    const int count = type == "radial3" ? 3 : type == "brown" ? 5 : type == "fisheye4" ? 4 : 1;
    const double terms[] = {t.k[0], t.k[1], t.k[2], type == "fisheye4" ? t.k[3] : t.p1, t.p2};
    for (int i = 0; i < count; ++i) {
      distortion += fmt::format("{}\"{}\"", i > 0 ? ", " : "", terms[i]);
    }
    const double ratio = pixels ? 1 : newest ? t.fy / t.f : t.f / t.fy;
    const std::string scale =
        pixels
            ? fmt::format(R"("pxInitialFocalLength": "500", "pxFocalLength": "{}")", t.f)
            : fmt::format(
                  R"("sensorWidth": "23.5", "sensorHeight": "15.6", "initialFocalLength": "-1", "focalLength": "{}", "pixelRatio": "{}")",
                  t.f / kW * 23.5, ratio);
    const double dx = pixels ? 0 : kW / 2, dy = pixels ? 0 : kH / 2;
    const std::string text = fmt::format(
        R"({{"version": ["1", "{}", "{}"], "views": [{}], "intrinsics": [{{"intrinsicId": "77", "width": "{}", "height": "{}", "type": "{}", {}, "principalPoint": ["{}", "{}"], "distortionParams": [{}], "undistortionOffset": ["0", "0"], "undistortionParams": "", "locked": "false"}}], "poses": [{}], "structure": [{}]}})"
        "\n",
        pixels ? "0" : "2",
        newest   ? "11"
        : pixels ? "0"
                 : "3",
        views, kW, kH, type, scale, t.cx - 0.5 - dx, t.cy - 0.5 - dy, distortion, poses, structure);
    Add("alicevision", type + "_" + version, "sfm.sfm", text, project, true);
  }

  void Mvsnet(Terms t) {
    const Projection project = OpenCvProjection(t);
    t = Faulty(t);
    const fs::path cams = folder / "mvsnet_plain" / "cams";
    fs::create_directories(cams);
    for (const TrueCamera& c : capture.cameras) {
      const Matrix3d r = Rotation(c);
      const Vector3d shift = -r * c.centre;
      std::string text = "extrinsic\n";
      for (int i = 0; i < 3; ++i) {
        text += fmt::format("{} {} {} {}\n", r(i, 0), r(i, 1), r(i, 2), shift[i]);
      }
      text += fmt::format(
          "0.0 0.0 0.0 1.0\n\nintrinsic\n{} 0.0 {}\n0.0 {} {}\n0.0 0.0 1.0\n\n1.5 0.02 192 6\n",
          t.f, t.cx, t.fy, t.cy);
      WriteFileAtomically(cams / (fs::path(c.name).stem().string() + "_cam.txt"), text);
    }
    programs.push_back({"mvsnet", "plain", cams.parent_path(), project, false});
  }

  // Position and Euler angles of a camera with axes x forward, y left, z up in such a world.
  void Miv(Terms t) {
    const Projection project = OpenCvProjection(t);
    t = Faulty(t);
    Matrix3d axes;
    axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    std::string cameras;
    for (const TrueCamera& c : capture.cameras) {
      const Matrix3d r = axes * Rotation(c).transpose() * axes.transpose();
      const Vector3d p = axes * c.centre;
      const double deg = 180 / std::numbers::pi;
      cameras += fmt::format(
          R"({{"Name": "{}", "Position": [{}, {}, {}], "Rotation": [{}, {}, {}], "Depthmap": 1, "Depth_range": [1, 9], "Resolution": [{}, {}], "Projection": "Perspective", "Focal": [{}, {}], "Principle_point": [{}, {}]}}, )",
          fs::path(c.name).stem().string(), p.x(), p.y(), p.z(), std::atan2(r(1, 0), r(0, 0)) * deg,
          std::asin(-r(2, 0)) * deg, std::atan2(r(2, 1), r(2, 2)) * deg, kW, kH, t.f, t.fy, t.cx,
          t.cy);
    }
    Add("miv", "plain", "sequence.json",
        R"({"Version": "2.0", "Content_name": "x", "BoundingBox_center": [0, 0, 0], "Fps": 30, "lengthsInMeters": true, "cameras": [)" +
            cameras +
            R"({"Name": "viewport", "Position": [0, 0, 0], "Rotation": [0, 0, 0], "Resolution": [64, 48], "Projection": "Perspective", "Focal": [50, 50], "Principle_point": [32, 24]}]})"
            "\n",
        project);
  }

  // NeRF's: world_from_camera in OpenGL's axes.
  void Transforms(Terms t) {
    const Projection project = OpenCvProjection(t);
    t = Faulty(t);
    std::string frames;
    for (const TrueCamera& c : capture.cameras) {
      const Matrix3d r = Rotation(c).transpose() * Vector3d(1, -1, -1).asDiagonal();
      frames += fmt::format(R"({}{{"file_path": "{}", "transform_matrix": [)",
                            frames.empty() ? "" : ", ", c.name);
      for (int i = 0; i < 3; ++i) {
        frames += fmt::format("[{}, {}, {}, {}], ", r(i, 0), r(i, 1), r(i, 2), c.centre[i]);
      }
      frames += "[0, 0, 0, 1]]}";
    }
    Add("nerf", "plain", "cameras.json",  // told by the content, not by the name
        fmt::format(
            R"({{"w": {}, "h": {}, "fl_x": {}, "fl_y": {}, "cx": {}, "cy": {}, "frames": [{}]}})"
            "\n",
            kW, kH, t.f, t.fy, t.cx, t.cy, frames),
        project);
  }

  void Colmap(Terms t) {
    const Projection project = OpenCvProjection(t);
    t = Faulty(t);
    const fs::path model = folder / "colmap_plain";
    fs::create_directories(model);
    std::string images;
    for (size_t i = 0; i < capture.cameras.size(); ++i) {
      const TrueCamera& c = capture.cameras[i];
      const Eigen::Quaterniond q(Rotation(c));
      const Vector3d shift = -Rotation(c) * c.centre;
      images += fmt::format("{} {} {} {} {} {} {} {} 1 {}\n\n", i + 1, q.w(), q.x(), q.y(), q.z(),
                            shift.x(), shift.y(), shift.z(), c.name);
    }
    WriteFileAtomically(model / "cameras.txt", fmt::format("1 PINHOLE {} {} {} {} {} {}\n", kW, kH,
                                                           t.f, t.fy, t.cx, t.cy));
    WriteFileAtomically(model / "images.txt", images);
    WriteFileAtomically(model / "points3D.txt", "");
    programs.push_back({"colmap", "plain", model, project, false});
  }
};

inline std::string TransformXml(const Matrix3d& r, const Vector3d& t, double s) {
  return fmt::format(
      "<transform><rotation locked=\"true\">{}</rotation><translation locked=\"true\">{} {} "
      "{}</translation><scale locked=\"true\">{}</scale></transform>\n",
      Row(r), t.x(), t.y(), t.z(), s);
}

}  // namespace dtr::testing
