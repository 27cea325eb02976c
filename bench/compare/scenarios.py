"""What is shown: places on the tile server's synthetic planet, and the flight from space to the ground."""
import dataclasses
import math

WIDTH, HEIGHT, VERTICAL_FOV = 1280, 720, 45
FRAMES_PER_SECOND = 30
REST_S, FLIGHT_S = 3.0, 20.0   # at the start of a flight everyone stands still, so that starting up is no part of it


@dataclasses.dataclass(frozen=True)
class Pose:
    """Degrees, metres above the ellipsoid; heading clockwise from north, pitch from the horizon."""
    lat: float
    lon: float
    height: float
    heading: float = 0.0
    pitch: float = -90.0

    def text(self):
        return f"{self.lat:.9g},{self.lon:.9g},{self.height:.9g},{self.heading:.9g},{self.pitch:.9g}"

    def numbers(self):
        return [self.lat, self.lon, self.height, self.heading, self.pitch]


@dataclasses.dataclass(frozen=True)
class Scenario:
    name: str
    about: str
    delay_ms: int              # before each tile's reply
    pose: Pose                 # where one stands, or arrives
    ground: float              # metres above the ellipsoid, about, of what is looked at
    start: Pose | None = None  # of a flight


MOUNTAIN = (20.5, -25.75)  # latitude and longitude of a summit
PLAIN = Pose(40, 50, 5500, 0, -15)
PEAK = Pose(20.15, -25.75, 6500, 0, -8)       # the highest mountain, 5,850 m; the ground below is at 4,700 m
RIDGE = Pose(52.35, 102.5, 5600, 30, -4)      # 800 m above the ground
SLOPE = Pose(-12.8, -44.0, 7500, 0, -40)
ARRIVAL = Pose(20.15, -25.75, 6750, 0, -20)   # 2 km above the ground
SPACE = Pose(5, -45, 15_000_000, 0, -90)

SCENARIOS = [
    Scenario("teleport-0ms", "5.5 km above a plain", 0, PLAIN, 92),
    Scenario("teleport-20ms", "5.5 km above a plain", 20, PLAIN, 92),
    Scenario("teleport-200ms", "5.5 km above a plain", 200, PLAIN, 92),
    Scenario("peak", "towards the highest mountain", 20, PEAK, 4900),
    Scenario("ridge", "low over mountains", 20, RIDGE, 4800),
    Scenario("slope", "steeply down onto mountains", 20, SLOPE, 4500),
    Scenario("space-to-ground", "from 15,000 km to 2 km above the ground in 20 s", 20, ARRIVAL, 4900, SPACE),
]


def eased(t):
    """From 0 to 1 with no speed at either end."""
    return t * t * (3 - 2 * t)


def flight_pose(scenario, seconds):
    t = eased(min(max((seconds - REST_S) / FLIGHT_S, 0.0), 1.0))
    a, b = scenario.start, scenario.pose
    def between(x, y, share):
        return x + (y - x) * share
    sideways = eased(min(t / 0.7, 1.0))        # above the place while still high
    tilt = eased(max((t - 0.6) / 0.4, 0.0))    # the view is raised near the ground only
    return Pose(between(a.lat, b.lat, sideways), between(a.lon, b.lon, sideways),
                math.exp(between(math.log(a.height), math.log(b.height), t)),
                b.heading, between(a.pitch, b.pitch, tilt))


def flight_rows(scenario, hold_s):
    """(seconds, pose) of every frame; `hold_s`: how long one stays after arriving."""
    count = round((REST_S + FLIGHT_S + hold_s) * FRAMES_PER_SECOND) + 1
    return [(i / FRAMES_PER_SECOND, flight_pose(scenario, i / FRAMES_PER_SECOND)) for i in range(count)]
