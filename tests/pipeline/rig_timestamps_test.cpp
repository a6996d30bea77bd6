// Tables of a rig's recording as programs write them.
#include "pipeline/core/photos/rig_timestamps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/message_of.h"

namespace dtr::pipeline {
namespace {

using ::testing::HasSubstr;

class RigTimestampsFile : public ::testing::Test {
 protected:
  RigTimestamps Read(const std::string& text) {
    WriteFileAtomically(File(), text);
    return ReadRigTimestamps(File());
  }
  std::filesystem::path File() const {
    return std::filesystem::path(::testing::TempDir()) /
           (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".csv");
  }
};

const RigTimeSteps kTwoCameras{{{0, 0}, 3}, {{0, 1}, 4}, {{1, 0}, 3}, {{1, 1}, 4}};

TEST_F(RigTimestampsFile, ColumnsMayStandInAnyOrderAmongOthers) {
  const RigTimestamps read = Read(
      "frame_time,frame_index,note,cam_id,sync_index\n"
      "0.1,0,x,0,3\n0.2,0,x,1,3\n0.3,1,x,0,4\n0.4,1,x,1,4\n");
  EXPECT_EQ(read.time_steps, kTwoCameras);
  EXPECT_FALSE(read.counted);
}

TEST_F(RigTimestampsFile, WithoutFrameIndexRowsOfACameraInOrderOfTimeAreItsFrames) {
  for (const char* rows : {"3,0,0.1\n3,1,0.2\n4,0,0.3\n4,1,0.4\n",     //
                           "3,0,0.1\n4,0,0.3\n3,1,0.2\n4,1,0.4\n",     // camera after camera
                           "4,1,0.4\n4,0,0.3\n3,1,0.2\n3,0,0.1\n"}) {  // last one first
    const RigTimestamps read = Read(std::string("sync_index,cam_id,frame_time\n") + rows);
    EXPECT_EQ(read.time_steps, kTwoCameras) << rows;
    EXPECT_TRUE(read.counted);
  }
}

TEST_F(RigTimestampsFile, ACameraThatMissedATimeStepHasNoFrameThere) {
  const RigTimeSteps expected{{{0, 0}, 0}, {{0, 1}, 1}, {{0, 2}, 2}, {{1, 0}, 0}, {{1, 1}, 2}};
  EXPECT_EQ(Read("sync_index,cam_id,frame_time\n0,0,1\n0,1,1\n1,0,2\n2,0,3\n2,1,3\n").time_steps,
            expected);
  EXPECT_EQ(
      Read("sync_index,cam_id,frame_time\n0,0,1\n0,1,1\n1,0,2\n1,1,\n2,0,3\n2,1,3\n").time_steps,
      expected);
  EXPECT_EQ(Read("sync_index,cam_id,frame_index\n0,0,0\n0,1,0.0\n1,0,1\n1,1,nan\n2,0,2\n2,1,1.0\n")
                .time_steps,
            expected);
}

TEST_F(RigTimestampsFile, LineEndsMarksQuotesAndSeparatorsOfOtherProgramsAreRead) {
  for (const char* text :
       {"sync_index,cam_id,frame_index\r\n3,0,0\r\n3,1,0\r\n4,0,1\r\n4,1,1\r\n",
        "\xEF\xBB\xBFsync_index,cam_id,frame_index\n3,0,0\n3,1,0\n4,0,1\n4,1,1\n",
        "\"sync_index\",\"cam_id\",\"frame_index\",\"a, \"\"b\"\"\"\n"
        "\"3\",0,0,\"x,y\"\n3,1,0,\n4,0,1,\n4,1,1,\n",
        "sync_index;cam_id;frame_index\n3;0;0\n3;1;0\n4;0;1\n4;1;1",
        "\n sync_index , cam_id , frame_index \n\n3, 0, 0\n3, 1, 0\n\n4, 0, 1\n4, 1, 1\n\n",
        "sync_index\tcam_id\tframe_index\n3\t0\t0\n3\t1\t0\n4\t0\t1\n4\t1\t1\n"}) {
    EXPECT_EQ(Read(text).time_steps, kTwoCameras) << text;
  }
}

TEST_F(RigTimestampsFile, WhatATableCannotMeanIsNamed) {
  const auto message = [&](const std::string& text) {
    return dtr::testing::MessageOf<Error>([&] { Read(text); });
  };
  EXPECT_THAT(message("time,camera\n1,2\n"),
              HasSubstr("expected a column sync_index, found time, camera"));
  EXPECT_THAT(message(""), HasSubstr("expected a column sync_index, found none"));
  EXPECT_THAT(message("sync_index,cam_id,frame_index\n0,0,1.5\n"),
              HasSubstr("line 2: frame_index: expected a whole number"));
  EXPECT_THAT(message("sync_index,cam_id\n0,\n"),
              HasSubstr("line 2: cam_id: expected a whole number"));
  EXPECT_THAT(message("sync_index,cam_id,frame_index\n0,0,5\n1,0,5\n"),
              HasSubstr("frame_index 5 stands at sync_index 0 and at 1"));
}

}  // namespace
}  // namespace dtr::pipeline
