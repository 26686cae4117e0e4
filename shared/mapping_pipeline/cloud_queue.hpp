// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "base/drop_counts.hpp"
#include "mapping_pipeline/cloud_sample.hpp"

namespace crane {

/// Clouds that wait for their positions, in order, and the account of their stream. One thread.
class CloudQueue {
 public:
  /// The oldest is given up when one more comes.
  static constexpr std::size_t kMost = 8;

  /// A cloud of another stream begins a new account; one that is known already is left out.
  void add(CloudSample cloud, TimeNs now, DropCounts& counts);
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }
  [[nodiscard]] CloudSample& oldest() { return waiting_.front(); }
  /// The oldest is done with; what lies between it and the last one never arrived.
  void done(bool integrated, DropCounts& counts);

  [[nodiscard]] const FrameAccount& account() const { return account_; }
  void restore(const FrameAccount& account) { account_ = account; }

 private:
  std::deque<CloudSample> waiting_;
  FrameAccount account_;
  std::int64_t newest_ = -1;  ///< of those that came
};

}  // namespace crane
