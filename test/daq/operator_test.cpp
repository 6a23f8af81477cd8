#include "daq/operator.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>

#include "daq/interrupt.hpp"

namespace kphi::daq {
namespace {

class Prompt : public testing::Test {
 protected:
  Prompt() {
    EXPECT_EQ(pipe(pipe_.data()), 0);
    words_ = open_memstream(&text_, &size_);
  }
  ~Prompt() override {
    close(pipe_[0]);
    std::fclose(words_);
    std::free(text_);
  }
  void answer(const std::string& typed) {
    EXPECT_EQ(write(pipe_[1], typed.data(), typed.size()), static_cast<ssize_t>(typed.size()));
    close(pipe_[1]);
  }
  void mount(double occlusion_deg) {
    TerminalOperator(pipe_[0], words_, [this] { return stop_; }).mount({"5x3", "Test 5 inch", 5, 3}, occlusion_deg);
  }
  std::string said() {
    std::fflush(words_);
    return {text_, size_};
  }

  std::array<int, 2> pipe_{};
  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* words_ = nullptr;
  bool stop_ = false;
};

TEST_F(Prompt, NamesWhatToMountAndThatTheMotorIsLocked) {
  answer("90\n");
  mount(90);
  EXPECT_NE(said().find("Mount the 90° occlusion under propeller 5x3"), std::string::npos) << said();
  EXPECT_NE(said().find("motor is locked"), std::string::npos);
}

TEST_F(Prompt, SaysNoOcclusionForZero) {
  answer("0\n");
  mount(0);
  EXPECT_NE(said().find("Mount no occlusion"), std::string::npos);
}

TEST_F(Prompt, AsksAgainAfterAWrongAngle) {
  answer("45\nninety\n\n90 \n90\n");
  mount(90);
  EXPECT_NE(said().find("\"45\" is not 90."), std::string::npos);
  EXPECT_NE(said().find("\"ninety\" is not 90."), std::string::npos);
}

TEST_F(Prompt, TakesQAsNo) {
  answer("q\n");
  EXPECT_THROW(mount(90), NotMounted);
}

TEST_F(Prompt, TakesEndOfFileAsNo) {
  answer("9");
  EXPECT_THROW(mount(90), NotMounted);
}

TEST_F(Prompt, StopsWhenASignalCame) {
  stop_ = true;
  answer("90\n");
  EXPECT_THROW(mount(90), Interrupted);
}

}  // namespace
}  // namespace kphi::daq
