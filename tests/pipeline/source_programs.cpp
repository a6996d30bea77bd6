#include "tests/pipeline/source_programs.h"

#include "tests/pipeline/source_writer.h"

namespace dtr::testing {

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
