// Owners of PROJ's objects. A context and all that is made in it belong to one thread.
#pragma once

#include <memory>
#include <string>

#include <proj.h>

namespace tellurion::source {

struct PjDelete {
  void operator()(PJ* pj) const { proj_destroy(pj); }
};
using PjPtr = std::unique_ptr<PJ, PjDelete>;

/// A context without network access that keeps its last message instead of printing it.
class ProjContext {
 public:
  ProjContext();
  ~ProjContext();
  ProjContext(const ProjContext&) = delete;
  ProjContext& operator=(const ProjContext&) = delete;

  PJ_CONTEXT* get() const { return context_; }
  /// The last thing that PROJ had to say; empty if nothing.
  const std::string& last_message() const { return last_message_; }

 private:
  PJ_CONTEXT* context_ = nullptr;
  std::string last_message_;
};

}  // namespace tellurion::source
