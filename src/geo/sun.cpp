#include "geo/sun.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numbers>

#include "geo/body.h"

namespace tellurion::geo {
namespace {

constexpr double kRadian = std::numbers::pi / 180.0;
constexpr double kAstronomicalUnit = 1.495978707e11;  // metres
constexpr double kEarthRadius = 6378137.0;

double sin_degrees(double angle) { return std::sin(std::remainder(angle, 360.0) * kRadian); }
double cos_degrees(double angle) { return std::cos(std::remainder(angle, 360.0) * kRadian); }

glm::dvec3 direction(double longitude, double latitude) {
  return {cos_degrees(latitude) * cos_degrees(longitude), cos_degrees(latitude) * sin_degrees(longitude),
          sin_degrees(latitude)};
}

/// Days since noon of 2000-01-01, UTC.
double days_since_2000(UtcTime time) {
  using namespace std::chrono;
  constexpr UtcTime kEpoch = sys_days(year(2000) / 1 / 1) + hours(12);
  return static_cast<double>((time - kEpoch).count()) / 86400e3;
}

/// The same in terrestrial time, of which UTC has fallen behind by 29 s in 1950 to 69 s in 2017 (this line: within 5
/// s).
double terrestrial_days(double days) {
  const double years_since_1950 = days / 365.25 + 50.0;
  return days + std::min(69.2, 29.0 + 0.6 * years_since_1950) / 86400.0;
}

/// Turns by `angle` degrees, from y to z and from x to y.
glm::dvec3 turned_about_x(const glm::dvec3& v, double angle) {
  const double c = cos_degrees(angle), s = sin_degrees(angle);
  return {v.x, c * v.y - s * v.z, s * v.y + c * v.z};
}
glm::dvec3 turned_about_z(const glm::dvec3& v, double angle) {
  const double c = cos_degrees(angle), s = sin_degrees(angle);
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}

/// The Sun as seen from the Earth, ecliptic of date without nutation (degrees, astronomical units).
struct SolarPlace {
  double longitude;
  double distance;
};
SolarPlace solar_place(double days) {
  const double t = days / 36525.0;
  const double mean_longitude = 280.46646 + t * (36000.76983 + t * 0.0003032);
  const double anomaly = 357.52911 + t * (35999.05029 - t * 0.0001537);
  const double eccentricity = 0.016708634 - t * (0.000042037 + t * 0.0000001267);
  const double centre = (1.914602 - t * (0.004817 + t * 0.000014)) * sin_degrees(anomaly) +
                        (0.019993 - t * 0.000101) * sin_degrees(2.0 * anomaly) + 0.000289 * sin_degrees(3.0 * anomaly);
  const double distance =
      1.000001018 * (1.0 - eccentricity * eccentricity) / (1.0 + eccentricity * cos_degrees(anomaly + centre));
  return {mean_longitude + centre - 0.00569, distance};  // the constant is the aberration
}

double mean_obliquity(double days) { return 23.439291 - 0.0130042 * days / 36525.0; }

/// The Moon as seen from the Earth, metres, ecliptic of date. Error about 0.3 degrees and 0.2 %.
glm::dvec3 moon_position(double days) {
  const double t = days / 36525.0;
  const auto sine = [t](double at_epoch, double per_century) { return sin_degrees(at_epoch + per_century * t); };
  const auto cosine = [t](double at_epoch, double per_century) { return cos_degrees(at_epoch + per_century * t); };
  const double longitude = 218.32 + 481267.881 * t + 6.29 * sine(135.0, 477198.87) - 1.27 * sine(259.3, -413335.36) +
                           0.66 * sine(235.7, 890534.22) + 0.21 * sine(269.9, 954397.74) -
                           0.19 * sine(357.5, 35999.05) - 0.11 * sine(186.5, 966404.03);
  const double latitude = 5.13 * sine(93.3, 483202.02) + 0.28 * sine(228.2, 960400.89) - 0.28 * sine(318.3, 6003.15) -
                          0.17 * sine(217.6, -407332.21);
  const double parallax = 0.9508 + 0.0518 * cosine(135.0, 477198.87) + 0.0095 * cosine(259.3, -413335.36) +
                          0.0078 * cosine(235.7, 890534.22) + 0.0028 * cosine(269.9, 954397.74);
  return direction(longitude, latitude) * (kEarthRadius / sin_degrees(parallax));
}

}  // namespace

Vector<Ecef> sun_over_earth(UtcTime time) {
  const double universal = days_since_2000(time);
  const double terrestrial = terrestrial_days(universal);
  const double node = 125.04 - 1934.136 * terrestrial / 36525.0;  // of the Moon's orbit: drives the nutation
  const double nutation = -0.00478 * sin_degrees(node);
  const double obliquity = mean_obliquity(terrestrial) + 0.00256 * cos_degrees(node);
  const glm::dvec3 equatorial =
      turned_about_x(direction(solar_place(terrestrial).longitude + nutation, 0.0), obliquity);
  const double t = universal / 36525.0;
  const double sidereal =
      280.46061837 + 360.98564736629 * universal + 0.000387933 * t * t + nutation * cos_degrees(obliquity);
  return {turned_about_z(equatorial, -sidereal)};
}

Vector<Ecef> sun_over_moon(UtcTime time) {
  const double days = terrestrial_days(days_since_2000(time));
  const SolarPlace sun = solar_place(days);
  const glm::dvec3 from_moon = direction(sun.longitude, 0.0) * (sun.distance * kAstronomicalUnit) - moon_position(days);
  // To the equator of 2000, in which the IAU gives the poles: precession is a turn about the ecliptic's pole to 0.01
  // degrees.
  const double precession = 1.396971 * days / 36525.0;
  const glm::dvec3 equatorial = turned_about_x(turned_about_z(from_moon, -precession), mean_obliquity(0.0));

  const double t = days / 36525.0;
  const double e1 = 125.045 - 0.0529921 * days;
  const double e2 = 250.089 - 0.1059842 * days;
  const double e3 = 260.008 + 13.0120009 * days;
  const double e4 = 176.625 + 13.3407154 * days;
  const double e5 = 357.529 + 0.9856003 * days;
  const double e6 = 311.589 + 26.4057084 * days;
  const double pole_ra = 269.9949 + 0.0031 * t - 3.8787 * sin_degrees(e1) - 0.1204 * sin_degrees(e2) +
                         0.0700 * sin_degrees(e3) - 0.0172 * sin_degrees(e4) + 0.0072 * sin_degrees(e6);
  const double pole_declination = 66.5392 + 0.0130 * t + 1.5419 * cos_degrees(e1) + 0.0239 * cos_degrees(e2) -
                                  0.0278 * cos_degrees(e3) + 0.0068 * cos_degrees(e4) - 0.0029 * cos_degrees(e6);
  const double meridian = 38.3213 + 13.17635815 * days - 1.4e-12 * days * days + 3.5610 * sin_degrees(e1) +
                          0.1208 * sin_degrees(e2) - 0.0642 * sin_degrees(e3) + 0.0158 * sin_degrees(e4) +
                          0.0252 * sin_degrees(e5) - 0.0066 * sin_degrees(e6);
  const glm::dvec3 from_node = turned_about_z(equatorial, -(90.0 + pole_ra));
  return {glm::normalize(turned_about_z(turned_about_x(from_node, -(90.0 - pole_declination)), -meridian))};
}

Vector<Ecef> sun_over_mars(UtcTime time) {
  const double days = terrestrial_days(days_since_2000(time));
  const double anomaly = 19.3871 + 0.52402073 * days;
  const double mean_sun = 270.3871 + 0.524038496 * days;
  constexpr struct {
    double amplitude, period, phase;
  } kPerturbers[] = {{0.0071, 2.2353, 49.409},  {0.0057, 2.7543, 168.173}, {0.0039, 1.1177, 191.837},
                     {0.0037, 15.7866, 21.736}, {0.0021, 2.1354, 15.704},  {0.0020, 2.4694, 95.528},
                     {0.0018, 32.8493, 49.095}};
  double centre = (10.691 + 3e-7 * days) * sin_degrees(anomaly) + 0.623 * sin_degrees(2.0 * anomaly) +
                  0.050 * sin_degrees(3.0 * anomaly) + 0.005 * sin_degrees(4.0 * anomaly) +
                  0.0005 * sin_degrees(5.0 * anomaly);
  for (const auto& p : kPerturbers) centre += p.amplitude * cos_degrees(0.985626 * days / p.period + p.phase);
  const double solar_longitude = mean_sun + centre;
  const double equation_of_time = 2.861 * sin_degrees(2.0 * solar_longitude) -
                                  0.071 * sin_degrees(4.0 * solar_longitude) +
                                  0.002 * sin_degrees(6.0 * solar_longitude) - centre;
  // Mean solar time at the prime meridian, in turns, since its midnight of 2000-01-06.
  const double sols = (days - 4.5) / 1.0274912517 + 44796.0 - 0.0009626;
  const double west_longitude = 360.0 * (sols - std::floor(sols)) + equation_of_time + 180.0;
  const double declination = std::asin(0.42565 * sin_degrees(solar_longitude)) / kRadian;
  return {direction(-west_longitude, declination)};
}

std::optional<Vector<Ecef>> direction_to_sun(std::string_view body, UtcTime time) {
  const std::optional<Body> known = find_body(body);
  if (!known) return std::nullopt;
  if (known->name == "Earth") return sun_over_earth(time);
  if (known->name == "Moon") return sun_over_moon(time);
  if (known->name == "Mars") return sun_over_mars(time);
  return std::nullopt;
}

}  // namespace tellurion::geo
