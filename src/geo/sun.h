// Where the Sun stands in the sky of a body.
// Thread-safe: pure functions. Valid for 1950 to 2050; UTC is taken as UT1 (at most 0.9 s apart: 0.004 degrees).
// Earth: J. Meeus, Astronomical Algorithms, 2nd edition, chapters 12, 22, 25 (low accuracy).
// Moon: rotation by the IAU report 2009 (doi:10.1007/s10569-010-9320-4); position by the Astronomical Almanac, page
// D22. Mars: M. Allison and M. McEwen (2000), doi:10.1016/S0032-0633(99)00092-6, as in the program Mars24.
#pragma once

#include <optional>
#include <string_view>

#include "base/time.h"
#include "geo/frames.h"

namespace tellurion::geo {

/// Unit direction from the Earth's centre to the Sun. Error below 0.02 degrees.
Vector<Ecef> sun_over_earth(UtcTime time);

/// Unit direction from the Moon's centre to the Sun. Error below 0.05 degrees.
Vector<Ecef> sun_over_moon(UtcTime time);

/// Unit direction from the centre of Mars to the Sun. Error below 0.05 degrees.
Vector<Ecef> sun_over_mars(UtcTime time);

/// The direction for a body by its name (see find_body); nothing for bodies whose rotation is not known here: light
/// them from the camera.
std::optional<Vector<Ecef>> direction_to_sun(std::string_view body, UtcTime time);

}  // namespace tellurion::geo
