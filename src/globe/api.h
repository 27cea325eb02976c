// All that a program needs to embed a globe, in one header.
#pragma once

#include "base/quantity.h"
#include "base/result.h"
#include "base/time.h"
#include "globe/frame_stats.h"
#include "globe/globe.h"
#include "globe/globe_view.h"
#include "globe/kept_files.h"
#include "globe/layer_facts.h"
#include "globe/picture_file.h"
#include "globe/prefetch.h"
#include "globe/world.h"
#include "source/raster_source.h"
#include "view/camera.h"
#include "view/controllers.h"
#include "view/flight.h"
#include "view/journey.h"
