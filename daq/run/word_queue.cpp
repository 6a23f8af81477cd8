#include "daq/run/word_queue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace kphi::daq {

std::list<WordQueue::Text>::iterator WordQueue::first_whole() noexcept {
  return std::next(texts_.begin(), is_begun_ ? 1 : 0);
}

bool WordQueue::drop_one() noexcept {
  const auto first = first_whole();
  if (first == texts_.end()) return false;
  auto least = std::find_if(first, texts_.end(), [](const Text& text) { return text.worth != Worth::kept; });
  if (least == texts_.end()) {
    least = first;
    ++lost_;
    ++untold_;
  }
  size_ -= least->bytes.size();
  texts_.erase(least);
  return true;
}

void WordQueue::push(std::string text, Worth worth, std::uint64_t order) {
  if (text.empty()) return;
  if (worth == Worth::live && first_whole() != texts_.end() && texts_.back().worth == Worth::live) {
    size_ -= texts_.back().bytes.size();
    texts_.pop_back();
  }
  while (size_ + text.size() > kRoom && drop_one()) {
  }
  size_ += text.size();
  texts_.push_back({std::move(text), worth, order});
}

std::string_view WordQueue::begin(std::size_t most) {
  if (!is_begun_ && untold_ > 0) {
    std::string note = fmt::format("kphi: this output was blocked; messages lost here: {}\n", untold_);
    size_ += note.size();
    texts_.push_front({std::move(note), Worth::kept, order()});
    untold_ = 0;
  }
  is_begun_ = true;
  return std::string_view(texts_.front().bytes).substr(gone_, most);
}

void WordQueue::taken(std::size_t n) noexcept {
  gone_ += n;
  if (gone_ < texts_.front().bytes.size()) return;
  size_ -= texts_.front().bytes.size();
  texts_.pop_front();
  gone_ = 0;
  is_begun_ = false;
}

void WordQueue::clear() noexcept {
  texts_.clear();
  size_ = gone_ = 0;
  is_begun_ = false;
  untold_ = 0;
}

}  // namespace kphi::daq
