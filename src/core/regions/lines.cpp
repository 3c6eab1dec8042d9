#include "regions/lines.hpp"

#include "base/assert.hpp"

namespace superfacets {
namespace {

class LineTracer {
 public:
  explicit LineTracer(std::span<const SegmentEnd> partners)
      : partners_(partners), is_traced_(partners.size() / 2) {
    lines_.offsets.push_back(0);
    lines_.entries.reserve(is_traced_.size());
  }

  // Traces the line that enters a segment at the end `entry`, if the segment has not been traced
  // yet.
  void trace_from(SegmentEnd entry, bool is_closed) {
    if (is_traced_[entry / 2]) return;
    while (entry != kNoEnd && !is_traced_[entry / 2]) {
      is_traced_[entry / 2] = true;
      lines_.entries.push_back(entry);
      entry = partners_[entry ^ 1];
    }
    lines_.offsets.push_back(static_cast<std::int64_t>(lines_.entries.size()));
    lines_.are_closed.push_back(static_cast<std::uint8_t>(is_closed));
  }

  Lines take() && { return std::move(lines_); }

 private:
  const std::span<const SegmentEnd> partners_;
  std::vector<bool> is_traced_;  // whether each segment has been traced
  Lines lines_;
};

}  // namespace

Lines trace_lines(std::span<const SegmentEnd> partners) {
  const auto n_ends = static_cast<SegmentEnd>(partners.size());
  SUPERFACETS_ASSERT(n_ends % 2 == 0);
  LineTracer tracer(partners);
  for (const SegmentEnd first : {0, 1}) {
    for (SegmentEnd end = first; end < n_ends; end += 2) {
      if (partners[end] == kNoEnd) tracer.trace_from(end, false);
    }
  }
  for (SegmentEnd end = 0; end < n_ends; end += 2) tracer.trace_from(end, true);
  return std::move(tracer).take();
}

}  // namespace superfacets
