#include "source/proj/proj_context.h"

namespace tellurion::source {

ProjContext::ProjContext() : context_(proj_context_create()) {
  proj_context_set_enable_network(context_, 0);
  proj_log_level(context_, PJ_LOG_ERROR);
  proj_log_func(context_, this, [](void* self, int, const char* message) {
    static_cast<ProjContext*>(self)->last_message_ = message;
  });
}

ProjContext::~ProjContext() { proj_context_destroy(context_); }

}  // namespace tellurion::source
