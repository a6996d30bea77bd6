#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <regex>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/report/contact_sheet.h"
#include "dtr/report/encode.h"
#include "dtr/report/false_color.h"
#include "dtr/report/html.h"
#include "dtr/report/plot.h"
#include "dtr/report/set_report.h"

namespace dtr::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Colours at the edge of the gamut are clipped to it; worst of 402: 0.85.
constexpr double kLightness = 1.5;

/// Lightness L* of an sRGB colour, 0..100.
double Lightness(const std::array<std::uint8_t, 3>& c) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 116 * std::cbrt(0.2126 * linear(c[0] / 255.0) + 0.7152 * linear(c[1] / 255.0) +
                         0.0722 * linear(c[2] / 255.0)) -
         16;
}

TEST(Base64, VectorsOfTheStandard) {  // RFC 4648, section 10
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64(std::string("\xff\xfe\x00", 3)), "//4A");
}

TEST(EscapeHtml, HostileTextBecomesHarmless) {
  EXPECT_EQ(EscapeHtml("<script>\"&'"), "&lt;script&gt;&quot;&amp;&#39;");
  EXPECT_EQ(EscapeHtml("caf\xC3\xA9 \xE6\x97\xA5 \xF0\x9F\x93\xB7"),
            "caf\xC3\xA9 \xE6\x97\xA5 \xF0\x9F\x93\xB7");
  const std::string bad = "\xEF\xBF\xBD";
  EXPECT_EQ(EscapeHtml("\xff"), bad);
  // What would show "a<RLO>gpj.exe" as "aexe.jpg"; a dash of the same first bytes stays.
  EXPECT_EQ(EscapeHtml("a\xE2\x80\xAEgpj"), "a" + std::string(bad) + "gpj");
  EXPECT_EQ(EscapeHtml("a\xE2\x80\x93"
                       "b"),
            "a\xE2\x80\x93"
            "b");
  EXPECT_EQ(EscapeHtml("\xC3"), bad);                      // cut short
  EXPECT_EQ(EscapeHtml("\xC0\xBC"), bad + bad);            // overlong '<'
  EXPECT_EQ(EscapeHtml("\xED\xA0\x80"), bad + bad + bad);  // surrogate
  EXPECT_EQ(EscapeHtml(std::string("a\0b\x1b", 4)), "a" + bad + "b" + bad);
  EXPECT_EQ(EscapeHtml("\xC3<b>"), bad + "&lt;b&gt;");  // a broken sequence swallows nothing
}

TEST(EncodeJpeg, IsAJpegAndRejectsWhatIsNoPicture) {
  const ImageRgb8 image(33, 17, 3, 90);
  const std::string file = EncodeJpeg(image, 90);
  EXPECT_EQ(file.substr(0, 3), "\xFF\xD8\xFF");
  EXPECT_EQ(file.substr(file.size() - 2), "\xFF\xD9");
  EXPECT_EQ(file, EncodeJpeg(image, 90));
  EXPECT_THROW(EncodeJpeg(ImageRgb8(), 90), Error);
  EXPECT_THROW(EncodeJpeg(ImageRgb8(4, 4, 1), 90), Error);
  EXPECT_THROW(EncodeJpeg(ImageRgb8(65501, 1, 3), 90), Error);
}

TEST(PaletteColor, GetsBrighterAllTheWayAndNeverLooksLikeAHole) {
  for (const Palette palette : {Palette::kColor, Palette::kGrey}) {
    for (int i = 0; i <= 200; ++i) {
      const auto color = PaletteColor(palette, i / 200.0);
      EXPECT_NEAR(Lightness(color), 12 + 84 * i / 200.0, kLightness) << i;
      int distance = 0;
      for (size_t c = 0; c < 3; ++c) distance += std::abs(color[c] - kHoleColor[c]);
      EXPECT_GT(distance, 60) << i;
    }
    EXPECT_EQ(PaletteColor(palette, -5), PaletteColor(palette, 0));
    EXPECT_EQ(PaletteColor(palette, 7), PaletteColor(palette, 1));
    EXPECT_EQ(PaletteColor(palette, std::nan("")), PaletteColor(palette, 0));
  }
}

TEST(ColorizeDepth, CloserIsBrighterAndHolesAreMarked) {
  DepthImage depth(3, 1);
  depth(0, 0) = 1;
  depth(1, 0) = 4;
  const ImageRgb8 image = ColorizeDepth(depth);
  const auto at = [&](int x) {
    return std::array<std::uint8_t, 3>{image(x, 0, 0), image(x, 0, 1), image(x, 0, 2)};
  };
  EXPECT_GT(Lightness(at(0)), Lightness(at(1)));
  EXPECT_EQ(at(2), kHoleColor);
  EXPECT_EQ(at(1), PaletteColor(Palette::kColor, 0));
}

TEST(ColorizeDepth, GivenRangeDecidesAndFlatMapsAreShown) {
  DepthImage depth(2, 1);
  depth(0, 0) = depth(1, 0) = 2;
  EXPECT_EQ(ColorizeDepth(depth)(0, 0, 0), PaletteColor(Palette::kColor, 1)[0]);
  // 1/2 lies in the middle of 1/1 and 1/inf: half of the ramp.
  const ImageRgb8 grey = ColorizeDepth(depth, {Palette::kGrey, 1e9, 1.0});
  EXPECT_NEAR(grey(0, 0, 0), PaletteColor(Palette::kGrey, 0.5)[0], 1);
  EXPECT_TRUE(ColorizeDepth(DepthImage()).empty());
  const ImageRgb8 holes = ColorizeDepth(DepthImage(2, 2));
  EXPECT_EQ(holes(1, 1, 1), kHoleColor[1]);
}

TEST(ScaleOfDepth, EndsAreThePercentilesOrWhatIsGiven) {
  DepthImage depth(1000, 1);
  for (int x = 0; x < 1000; ++x) depth(x, 0) = 1 / (0.1f + 0.001f * static_cast<float>(x));
  const auto scale = ScaleOfDepth(depth);
  ASSERT_TRUE(scale);
  EXPECT_NEAR(scale->dark, 1 / 0.11, 0.05);
  EXPECT_NEAR(scale->bright, 1 / 1.089, 0.005);
  EXPECT_DOUBLE_EQ(ScaleOfDepth(depth, {Palette::kColor, 20, 0.5})->dark, 20);
  EXPECT_FALSE(ScaleOfDepth(DepthImage(2, 2)));
}

TEST(ScaleOfSigma, IsInTheUnitOfItsValues) {
  Grid<float> sigma(3, 1);
  sigma(0, 0) = 1e-4f;
  sigma(1, 0) = 1e-2f;
  const auto scale = ScaleOfSigma(sigma);
  ASSERT_TRUE(scale);
  EXPECT_NEAR(scale->dark, 1e-4, 1e-8);
  EXPECT_NEAR(scale->bright, 1e-2, 1e-6);
}

TEST(ColorizeSigma, BrightIsUncertain) {
  Grid<float> sigma(4, 1);
  sigma(0, 0) = 1e-4f;
  sigma(1, 0) = 1e-2f;
  sigma(2, 0) = std::numeric_limits<float>::quiet_NaN();
  const ImageRgb8 image = ColorizeSigma(sigma, Palette::kGrey);
  EXPECT_LT(image(0, 0, 0), image(1, 0, 0));
  EXPECT_EQ(image(2, 0, 1), kHoleColor[1]);
  EXPECT_EQ(image(3, 0, 1), kHoleColor[1]);
}

TEST(Shrink, HandWorkedAreaMeans) {
  ImageRgb8 image(3, 2, 3);
  for (int c = 0; c < 3; ++c) {
    image(0, 0, c) = image(0, 1, c) = 0;
    image(1, 0, c) = image(1, 1, c) = 60;
    image(2, 0, c) = image(2, 1, c) = 120;
  }
  const ImageRgb8 small = Shrink(image, 2);  // 3 columns into 2: 1 + half of the middle one
  ASSERT_EQ(small.width(), 2);
  ASSERT_EQ(small.height(), 1);
  EXPECT_EQ(small(0, 0, 0), 20);
  EXPECT_EQ(small(1, 0, 0), 100);
  EXPECT_EQ(Shrink(image, 3), image);
  EXPECT_EQ(Shrink(ImageRgb8(1000, 1, 3, 7), 10).height(), 1);
  EXPECT_THROW(Shrink(image, 0), std::invalid_argument);
}

TEST(ContactSheet, PutsPicturesInRows) {
  const std::vector<ImageRgb8> images{ImageRgb8(20, 10, 3, 200), ImageRgb8(),
                                      ImageRgb8(5, 5, 3, 90)};
  const ImageRgb8 sheet = ContactSheet(images, 2, 10);
  EXPECT_EQ(sheet.width(), 2 * 14 + 4);
  EXPECT_EQ(sheet.height(), 2 * 14 + 4);
  EXPECT_EQ(sheet(9, 9, 0), 200);
  EXPECT_EQ(sheet(23, 9, 0), 24);
  EXPECT_EQ(sheet(9, 23, 0), 90);
  EXPECT_TRUE(ContactSheet({}, 2, 10).empty());
  EXPECT_THROW(ContactSheet(images, 0, 10), std::invalid_argument);
}

TEST(HtmlReport, NeedsNothingFromOutsideAndRunsNothing) {
  HtmlReport page("Title <1>");
  page.Section("A & B");
  page.Paragraph("<img src=x onerror=alert(1)>");
  page.Result(false, "broken");
  page.Table({"name", "value"}, {{std::string("</td><script>"), std::string("3.5 dB")}});
  page.Image("cap\"tion", ImageRgb8(4, 3, 3, 50));
  page.Svg("plot", "<svg xmlns=\"http://www.w3.org/2000/svg\"><script>alert(1)</script></svg>");
  const std::string html = page.Finish();
  EXPECT_THAT(html, HasSubstr("<title>Title &lt;1&gt;</title>"));
  EXPECT_THAT(html, HasSubstr("A &amp; B"));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  EXPECT_THAT(html, HasSubstr("class=\"number\">3.5 dB"));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("<img src=x")));
  EXPECT_THAT(html, Not(HasSubstr("http://")));
  EXPECT_THAT(html, Not(HasSubstr("https://")));
  EXPECT_EQ(html, page.Finish());
}

TEST(HtmlReport, NumbersStandUnderEachOtherAndNamesThatBeginWithDigitsDoNot) {
  HtmlReport page("t");
  page.Table({"view", "share"}, {{std::string("0010.jpg"), std::string("12.5 %")}});
  const std::string html = page.Finish();
  EXPECT_THAT(html, HasSubstr("<td data-column=\"view\" class=\"brief\">0010.jpg"));
  EXPECT_THAT(html, HasSubstr("class=\"number\">12.5 %"));
}

TEST(HtmlReport, RowsOfAnotherLengthAreRejected) {
  HtmlReport page("t");
  EXPECT_THROW(page.Table({"a", "b"}, {{std::string("1")}}), std::invalid_argument);
}

TEST(SetReport, ShowsViewsSkippedPhotosChecksAndTimes) {
  DtrSet set;
  set.frames.resize(1);
  for (int i = 0; i < 2; ++i) {
    View view;
    view.name = i == 0 ? "a<b>.jpg" : "held.jpg";
    view.role = i == 0 ? ViewRole::kSource : ViewRole::kHeldOut;
    view.camera = PinholeCamera(64, 48, 50, 50, 32, 24);
    view.image = ImageRgb8(64, 48, 3, 80);
    set.frames[0].views.push_back(std::move(view));
  }
  View& source = set.frames[0].views[0];
  source.depth = DepthImage(64, 48);
  for (int x = 0; x < 64; ++x) source.depth(x, 0) = 1.0f + static_cast<float>(x);
  source.near_z = 1;
  source.far_z = 64;
  SetReportInfo info;
  info.title = "sceaux";
  info.facts = {{"Engine", "sgbm"}};
  info.skipped = {{"notes.jpg", "no image"}};
  info.stages = {{"stereo", 12.34}, {"sfm", 1}};
  info.checks = {{"held_out_rms_px", std::nan(""), 1.5, false, "nothing measured"}};
  const std::string html = SetReport(set, info);
  for (const char* text : {"a&lt;b&gt;.jpg", "held out", "notes.jpg", "no image", "12.3 s",
                           "13.3 s", "held_out_rms_px", "FAILED", "2.1 %", "1 to 64", "sgbm"}) {
    EXPECT_THAT(html, HasSubstr(text));
  }
  EXPECT_THAT(html, Not(HasSubstr("Uncertainty")));
  EXPECT_EQ(html, SetReport(set, info));
}

Plot TwoGroups() {
  Plot plot;
  plot.x_label = "CPU ms a frame";
  plot.y_label = "error <levels>";
  plot.groups = {"deferred", "two-pass"};
  plot.points.resize(3);
  for (size_t i = 0; i < plot.points.size(); ++i) {
    plot.points[i].x = std::pow(10, i);
    plot.points[i].y = std::pow(10, 2.0 - static_cast<double>(i));
  }
  plot.points[0].tip = "cheap";
  plot.points[1].tip = "a & b\n--views 3";
  plot.points[1].x_low = 8;
  plot.points[1].x_high = 13;
  plot.points[2].tip = "good";
  plot.points[2].group = 1;
  plot.points[2].label = "knee";
  plot.points[2].ringed = true;
  plot.front = {0, 1, 2};
  return plot;
}

TEST(ScatterSvg, EqualFactorsAreEqualDistancesAndPointsSayWhatTheyAre) {
  const std::string svg = ScatterSvg(TwoGroups());
  // The middles of the points' invisible rims, in order.
  std::vector<double> xs, ys;
  const std::regex rim("<circle cx=\"([0-9.]+)\" cy=\"([0-9.]+)\" r=\"11\"");
  for (std::sregex_iterator at(svg.begin(), svg.end(), rim), end; at != end; ++at) {
    xs.push_back(std::stod((*at)[1]));
    ys.push_back(std::stod((*at)[2]));
  }
  ASSERT_EQ(xs.size(), 3u);
  constexpr double kPrinted = 0.11;  // one decimal each
  EXPECT_NEAR(xs[1] - xs[0], xs[2] - xs[1], kPrinted);
  EXPECT_NEAR(ys[1] - ys[0], ys[2] - ys[1], kPrinted);
  EXPECT_LT(xs[0], xs[1]);
  EXPECT_LT(ys[0], ys[1]);  // downwards, as errors fall
  EXPECT_NE(svg.find("<title>a &amp; b\n--views 3</title>"), std::string::npos);
  EXPECT_NE(svg.find("error &lt;levels&gt;"), std::string::npos);
  EXPECT_NE(svg.find(">knee</text>"), std::string::npos);
  EXPECT_EQ(svg.find("script"), std::string::npos);
  EXPECT_EQ(svg, ScatterSvg(TwoGroups()));
}

TEST(ScatterSvg, RejectsWhatNoLogarithmHas) {
  Plot plot = TwoGroups();
  plot.points[1].y = 0;
  EXPECT_THROW(ScatterSvg(plot), std::invalid_argument);
  plot = TwoGroups();
  plot.points[1].x = std::numeric_limits<double>::infinity();
  EXPECT_THROW(ScatterSvg(plot), std::invalid_argument);
  plot = TwoGroups();
  plot.points[0].group = 2;
  EXPECT_THROW(ScatterSvg(plot), std::invalid_argument);
  plot = TwoGroups();
  plot.front = {3};
  EXPECT_THROW(ScatterSvg(plot), std::invalid_argument);
  EXPECT_THROW(ScatterSvg(Plot{}), std::invalid_argument);
}

TEST(ScatterSvg, OnePointHasAPlace) {
  Plot plot = TwoGroups();
  plot.points.resize(1);
  plot.front = {0};
  EXPECT_EQ(ScatterSvg(plot).find("nan"), std::string::npos);
}

TEST(LogTicks, AreDecadesOrFinerWhereThereAreFew) {
  EXPECT_EQ(LogTicks(0.5, 2000), (std::vector<double>{1, 10, 100, 1000}));
  const std::vector<double> finer = LogTicks(3, 60);
  EXPECT_EQ(finer, (std::vector<double>{5, 10, 20, 50}));
  const std::vector<double> even = LogTicks(11.2, 13.9);
  ASSERT_EQ(even.size(), 5u);
  EXPECT_NEAR(even[0], 11.5, 1e-9);
  EXPECT_NEAR(even[4], 13.5, 1e-9);
}

TEST(HtmlReport, APlotIsPartOfThePage) {
  HtmlReport page("plots");
  page.Plot("caption", ScatterSvg(TwoGroups()));
  const std::string html = page.Finish();
  EXPECT_NE(html.find("<figure class=\"plot\"><svg"), std::string::npos);
  EXPECT_NE(html.find("<title>good</title>"), std::string::npos);
}

}  // namespace
}  // namespace dtr::report
