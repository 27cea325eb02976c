#!/usr/bin/env bash
# Installs the Debian packages that Tellurion needs: the one place where packages are installed.
# Does nothing, quickly, when everything is there.
set -euo pipefail

usage() {
  cat <<'USAGE'
usage: tools/setup.sh [--test] [--fuzz] [--bench] [--dry-run]

Installs what is missing of the Debian 12 packages to build and run Tellurion.
  --test      also what the tests need (doctest, GeographicLib, Python, Xvfb, ...)
  --fuzz      also what the fuzzers need (clang with libFuzzer)
  --bench     also what benchmarks compare with: Node.js, Chromium and npm packages (martini, CesiumJS, MapLibre GL JS)
  --dry-run   only name the missing packages
USAGE
}

build_packages=(
  g++ cmake ninja-build ccache mold pkg-config git
  libegl-dev libepoxy-dev libgl-dev libgles-dev libopengl-dev  # OpenGL headers and loader
  libegl-mesa0 libgl1-mesa-dri                                 # a driver that needs no GPU and no display
  libglfw3-dev libimgui-dev libstb-dev                         # the window
  libcli11-dev libfmt-dev libglm-dev libspdlog-dev libtomlplusplus-dev nlohmann-json3-dev
  libcurl4-openssl-dev libsqlite3-dev zlib1g-dev               # tiles from servers, and the disk cache
  libpugixml-dev                                               # what services say of themselves
  gdal-bin libgdal-dev libproj-dev proj-bin proj-data
  ffmpeg                                                       # writes the video of a flight
)
test_packages=(
  doctest-dev libgeographiclib-dev
  python3 python3-gdal python3-numpy
  imagemagick x11-apps xauth xdotool xvfb
  gmt-gshhg-low                                                # shorelines
  mapproxy nginx-light openssl                                 # services and a server to ask
  munge slurm-client slurmctld slurmd                          # a batch system of one machine
)
fuzz_packages=(clang libclang-rt-14-dev)
bench_packages=(chromium python3 python3-numpy python3-pil)  # bench/compare: the browser, and what a tile server makes tiles with

packages=("${build_packages[@]}")
dry_run=false
bench=false
while (($#)); do
  case $1 in
    --test) packages+=("${test_packages[@]}") ;;
    --fuzz) packages+=("${fuzz_packages[@]}") ;;
    --bench)
      bench=true
      packages+=("${bench_packages[@]}")
      command -v npm >/dev/null || packages+=(nodejs npm)
      ;;
    --dry-run) dry_run=true ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
  shift
done

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "tools/setup.sh: this is not a Debian system; install by hand: ${packages[*]}" >&2
  exit 1
fi

# The packages whose state is "installed", one name a line (without the architecture).
installed=$(dpkg-query --show --showformat '${db:Status-Status} ${binary:Package}\n' | sed -n 's/^installed //p' | sed 's/:.*//')
missing=()
for package in "${packages[@]}"; do
  grep -qxF -- "$package" <<<"$installed" || missing+=("$package")
done

# npm packages, once the Debian packages are there.
bench_folder=$(dirname "${BASH_SOURCE[0]}")/../bench
install_npm_packages() {
  $bench || return 0
  local name
  for name in martini compare; do
    # npm writes this file when it has installed everything.
    [[ -f $bench_folder/$name/node_modules/.package-lock.json ]] && continue
    npm ci --prefix "$bench_folder/$name" --ignore-scripts --no-audit --no-fund >&2
  done
}

((${#missing[@]})) || { $dry_run || install_npm_packages; exit 0; }

if $dry_run; then
  printf '%s\n' "${missing[@]}"
  exit 0
fi

as_root=()
if (($(id -u) != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "tools/setup.sh: neither root nor sudo; ask for: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "tools/setup.sh: installing ${missing[*]}" >&2
# Output goes to standard error: the caller's standard output stays its own.
"${as_root[@]}" apt-get update -q >&2
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >&2
install_npm_packages
