#include "tests/pipeline/source_programs.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "dtr/base/files.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kW = TrueCapture::kWidth, kH = TrueCapture::kHeight;

// What a file is made from: the numbers of one camera, in the words of the program.
struct Terms {
  double f = 500, fy = 500, cx = 324, cy = 236;  // pixels from the corner
  double k[6] = {0, 0, 0, 0, 0, 0};
  double p1 = 0, p2 = 0, p3 = 0, p4 = 0, b1 = 0, b2 = 0;
};

Terms Brown() {
  Terms t;
  t.k[0] = -0.11;
  t.k[1] = 0.07;
  t.k[2] = -0.02;
  t.p1 = 0.0012;
  t.p2 = -0.0031;
  return t;
}

Vector2d Normalised(const Vector3d& p) { return {p.x() / p.z(), p.y() / p.z()}; }

// Of OpenCV, OpenMVG, AliceVision and OpenSfM: x'' = x (1 + k1 r2 + ...) + 2 p1 x y + p2 (r2 +
// 2 x2), y'' = y (...) + p1 (r2 + 2 y2) + 2 p2 x y.
Vector2d OpenCvDistorted(const Vector2d& n, const Terms& t) {
  const double x = n.x(), y = n.y(), r2 = x * x + y * y;
  const double radial = 1 + t.k[0] * r2 + t.k[1] * r2 * r2 + t.k[2] * r2 * r2 * r2;
  return {x * radial + 2 * t.p1 * x * y + t.p2 * (r2 + 2 * x * x),
          y * radial + t.p1 * (r2 + 2 * y * y) + 2 * t.p2 * x * y};
}

Projection OpenCvProjection(const Terms& t) {
  return [t](const Vector3d& p) {
    const Vector2d d = OpenCvDistorted(Normalised(p), t);
    return Vector2d(t.f * d.x() + t.cx, t.fy * d.y() + t.cy);
  };
}

// theta (1 + k1 theta^2 + ...) in the direction of (x, y).
Projection FisheyeProjection(const Terms& t) {
  return [t](const Vector3d& p) {
    const double r = std::hypot(p.x(), p.y()), theta = std::atan2(r, p.z());
    const double s = theta * theta;
    const double d = theta * (1 + s * (t.k[0] + s * (t.k[1] + s * (t.k[2] + s * t.k[3]))));
    const double scale = r > 0 ? d / r : 0;
    return Vector2d(t.f * p.x() * scale + t.cx, t.fy * p.y() * scale + t.cy);
  };
}

// OpenSfM's fisheye62: (x, y) theta / r, six radial terms, tangential ones as OpenCV's.
Projection Fisheye62Projection(const Terms& t) {
  return [t](const Vector3d& p) {
    const double r = std::hypot(p.x(), p.y()), theta = std::atan2(r, p.z());
    const double x = p.x() * theta / r, y = p.y() * theta / r, s = theta * theta;
    double radial = 1;
    for (int i = 0; i < 6; ++i) radial += t.k[i] * std::pow(s, i + 1);
    return Vector2d(t.f * (x * radial + 2 * t.p1 * x * y + t.p2 * (s + 2 * x * x)) + t.cx,
                    t.fy * (y * radial + t.p1 * (s + 2 * y * y) + 2 * t.p2 * x * y) + t.cy);
  };
}

// AliceVision's fisheye1: r becomes atan(2 r tan(k / 2)) / k.
Projection Fisheye1Projection(const Terms& t) {
  return [t](const Vector3d& p) {
    const Vector2d n = Normalised(p);
    const double r = n.norm(), d = std::atan(2 * r * std::tan(t.k[0] / 2)) / t.k[0];
    return Vector2d(t.f * n.x() * d / r + t.cx, t.fy * n.y() * d / r + t.cy);
  };
}

// Metashape's manual: x' = x (1 + K1 r2 + K2 r4 + K3 r6 + K4 r8) + (P1 (r2 + 2 x2) + 2 P2 x y) (1 +
// P3 r2 + P4 r4), y' alike, u = w/2 + cx + x' f + x' B1 + y' B2, v = h/2 + cy + y' f. A fisheye
// takes x theta / r for x.
Projection MetashapeProjection(const Terms& t, bool fisheye) {
  return [t, fisheye](const Vector3d& p) {
    Vector2d n = Normalised(p);
    if (fisheye) n *= std::atan(n.norm()) / n.norm();
    const double x = n.x(), y = n.y(), r2 = n.squaredNorm(), r4 = r2 * r2;
    const double radial = 1 + t.k[0] * r2 + t.k[1] * r4 + t.k[2] * r4 * r2 + t.k[3] * r4 * r4;
    const double grow = 1 + t.p3 * r2 + t.p4 * r4;
    const double xd = x * radial + (t.p1 * (r2 + 2 * x * x) + 2 * t.p2 * x * y) * grow;
    const double yd = y * radial + (t.p2 * (r2 + 2 * y * y) + 2 * t.p1 * x * y) * grow;
    return Vector2d(t.cx + xd * t.f + xd * t.b1 + yd * t.b2, t.cy + yd * t.f);
  };
}

// RealityScan: as OpenCV with t2, t1 in the places of p1, p2.
Projection RealityScanProjection(const Terms& t) {
  return [t](const Vector3d& p) {
    const Vector2d n = Normalised(p);
    const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
    const double radial = 1 + r2 * (t.k[0] + r2 * (t.k[1] + r2 * (t.k[2] + r2 * t.k[3])));
    return Vector2d(t.f * (x * radial + t.p1 * (r2 + 2 * x * x) + 2 * t.p2 * x * y) + t.cx,
                    t.f * (y * radial + t.p2 * (r2 + 2 * y * y) + 2 * t.p1 * x * y) + t.cy);
  };
}

// VisualSFM: the measured point m, relative to the middle in focal lengths, fulfils m (1 + r |m|^2)
// = (x, y); found by bisection.
Projection VisualSfmProjection(double f, double r) {
  return [f, r](const Vector3d& p) {
    const Vector2d n = Normalised(p);
    double low = 0, high = 2;
    for (int i = 0; i < 200; ++i) {
      const double m = (low + high) / 2;
      (m * (1 + r * m * m) < n.norm() ? low : high) = m;
    }
    return Vector2d(n * (f * low / n.norm()) + Vector2d(kW / 2, kH / 2));
  };
}

std::string Row(const Matrix3d& m) {
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
          R"({}{{"viewId": "{}", "poseId": "{}", "intrinsicId": "77", "path": "C:/work/{}", "width": "{}", "height": "{}", "metadata": ""}})",
          comma, 1000 + i, 2000 + i, c.name, kW, kH);
      poses += fmt::format(R"({}{{"poseId": "{}", "pose": {{"transform": {{"rotation": [)", comma,
                           2000 + i);
      for (int j = 0; j < 9; ++j) {  // column by column
        poses += fmt::format("{}\"{}\"", j > 0 ? ", " : "", r(j % 3, j / 3));
      }
      poses += fmt::format(R"(], "center": ["{}", "{}", "{}"]}}, "locked": "1"}}}})", c.centre.x(),
                           c.centre.y(), c.centre.z());
    }
    views += R"(, {"viewId": "9", "poseId": "9", "intrinsicId": "77", "path": "C:/work/lost.jpg"})";
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

std::string TransformXml(const Matrix3d& r, const Vector3d& t, double s) {
  return fmt::format(
      "<transform><rotation locked=\"true\">{}</rotation><translation locked=\"true\">{} {} "
      "{}</translation><scale locked=\"true\">{}</scale></transform>\n",
      Row(r), t.x(), t.y(), t.z(), s);
}

}  // namespace

TrueCapture::TrueCapture(int point_count) {
  for (int i = 0; i < 5; ++i) {
    TrueCamera camera;
    camera.name = fmt::format("{:08}.jpg", i);
    camera.centre = Vector3d(-1.3 + 0.7 * i, 0.31 * (i % 3) - 0.4, -4.1 + 0.23 * i);
    const Vector3d forward = (Vector3d(0.1, -0.2, 0.3) - camera.centre).normalized();
    const Vector3d side =
        Eigen::AngleAxisd(0.13 * i - 0.2, forward) * Vector3d(0, 1, 0).cross(forward).normalized();
    camera.rotation.row(0) = side;
    camera.rotation.row(1) = forward.cross(side);
    camera.rotation.row(2) = forward;
    cameras.push_back(camera);
  }
  for (int i = 0; i < point_count; ++i) {
    points.emplace_back(1.2 * std::sin(2.3 * i + 0.4), 0.9 * std::sin(1.7 * i + 1.1),
                        1.0 * std::sin(0.9 * i));
  }
}

std::vector<SourceProgram> WriteAllPrograms(const TrueCapture& capture, const fs::path& folder,
                                            Fault fault) {
  Writer w{capture, folder, fault};
  const Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(0.2, -0.5, 0.4).normalized()).matrix();
  const Matrix3d one = Matrix3d::Identity();
  const Vector3d shift(12, -7, 3), none = Vector3d::Zero();
  Terms full = Brown();
  full.k[3] = 0.013;
  full.p3 = 0.2;
  full.p4 = -0.1;
  full.b1 = 1.7;
  full.b2 = -0.9;
  Terms bent = Brown();
  bent.k[2] = -0.002;
  const auto component = [](const std::string& inside) {
    return "  <components next_id=\"1\"><component id=\"0\" label=\"Component 1\">" + inside +
           "</component></components>\n";
  };
  w.Metashape("frame", Brown(), false, "", "", one, none, 1);
  w.Metashape("affine", full, false, component(TransformXml(turn, shift, 2.5)), "", turn, shift,
              2.5);
  w.Metashape("both", Brown(), false, component(TransformXml(turn, none, 2)),
              TransformXml(one, shift, 1.5), turn, shift, 3);
  w.Metashape("repeated", Brown(), false, component(TransformXml(turn, shift, 2.5)),
              TransformXml(turn, shift, 2.5), turn, shift, 2.5);
  w.Metashape("fisheye", bent, true, "", "", one, none, 1);
  w.RealityScan(false);
  w.RealityScan(true);
  w.RealityScanOpenCv();
  Terms radial;
  radial.cx = kW / 2;
  radial.cy = kH / 2;
  radial.k[0] = -0.12;
  radial.k[1] = 0.06;
  Terms one_k = Brown();
  one_k.k[1] = one_k.k[2] = one_k.p1 = one_k.p2 = 0;
  Terms four = Brown();
  four.p1 = four.p2 = 0;
  four.k[3] = 0.003;
  four.fy = 504;
  w.OpenSfm("perspective", radial, OpenCvProjection(radial), false);
  w.OpenSfm("simple_radial", one_k, OpenCvProjection(one_k), false);
  Terms brown = Brown();
  brown.fy = 504;
  w.OpenSfm("brown", brown, OpenCvProjection(brown), true);
  w.OpenSfm("fisheye", radial, FisheyeProjection(radial), false);
  w.OpenSfm("fisheye_opencv", four, FisheyeProjection(four), false);
  w.OpenSfm("radial", radial, OpenCvProjection(radial), false);
  Terms six = bent;
  six.k[3] = 0.003;
  six.k[4] = -0.002;
  six.k[5] = 0.001;
  six.fy = 504;
  w.OpenSfm("fisheye62", six, Fisheye62Projection(six), false);
  w.Bundler();
  w.Nvm("barrel", 0.15, false);
  w.Nvm("cushion", -0.1, true);
  Terms square = Brown();
  Terms square_fisheye = four;
  square_fisheye.fy = square_fisheye.f;
  Terms three = Brown();
  three.p1 = three.p2 = 0;
  w.OpenMvg("pinhole", Terms(), OpenCvProjection(Terms()));
  w.OpenMvg("pinhole_radial_k1", one_k, OpenCvProjection(one_k));
  w.OpenMvg("pinhole_radial_k3", three, OpenCvProjection(three));
  w.OpenMvg("pinhole_brown_t2", square, OpenCvProjection(square));
  w.OpenMvg("fisheye", square_fisheye, FisheyeProjection(square_fisheye));
  w.AliceVision("radial3", "0", three, OpenCvProjection(three));
  Terms wide = three;
  wide.fy = 510;
  w.AliceVision("radial3", "3", wide, OpenCvProjection(wide));
  w.AliceVision("brown", "11", brown, OpenCvProjection(brown));
  w.AliceVision("fisheye4", "11", four, FisheyeProjection(four));
  w.AliceVision("radial1", "11", one_k, OpenCvProjection(one_k));
  Terms view = one_k;
  view.k[0] = 0.9;
  w.AliceVision("fisheye1", "11", view, Fisheye1Projection(view));
  w.Mvsnet(Terms());
  w.Miv(Terms());
  return w.programs;
}

std::vector<SourceProgram> WritePlainPrograms(const TrueCapture& capture, const fs::path& folder) {
  Writer w{capture, folder, Fault::kNone};
  const Terms t;
  const Projection project = OpenCvProjection(t);
  w.Colmap(t);
  w.Transforms(t);
  w.Metashape("plain", t, false, "", "", Matrix3d::Identity(), Vector3d::Zero(), 1);
  w.OpenSfm("brown", t, project, true);
  w.OpenMvg("pinhole", t, project);
  w.AliceVision("radial3", "11", t, project);
  w.Mvsnet(t);
  w.Miv(t);
  return w.programs;
}

}  // namespace dtr::testing
