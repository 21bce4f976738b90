#!/usr/bin/env bash
# Checks the library in the repository and opens reports in headless Chromium: see check.mjs.
#
#     bash tests/report/check.sh [--pictures FOLDER] [--quick] REPORT...
#
# Installs the pinned tools in a temporary folder (or in $REPORT_TOOLS, where they stay), and Debian's chromium if there is none.

set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
library=$here/../../crates/results/src/report/three

packages=(playwright-core@1.65.1 axe-core@4.14.1 three@0.187.0 esbuild@0.28.2)

if [ -n "${REPORT_TOOLS:-}" ]; then
    tools=$REPORT_TOOLS
    mkdir -p "$tools"
else
    tools=$(mktemp -d)
    trap 'rm -rf "$tools"' EXIT
fi

export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
if [ ! -x "$CHROMIUM" ]; then
    sudo=()
    [ "$(id -u)" = 0 ] || sudo=(sudo)
    "${sudo[@]}" apt-get update -q
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends chromium fonts-dejavu-core
fi
# esbuild's own program is a package for each system; nothing has to be run to install it.
npm install --no-save --no-fund --no-audit --ignore-scripts --silent --prefix "$tools" "${packages[@]}"

# The 3D view's library is what its README says.
cp "$library/entry.js" "$tools/entry.js"
(cd "$tools" && node_modules/.bin/esbuild entry.js --bundle --minify --format=iife --global-name=THREE --legal-comments=inline \
    --log-level=warning --outfile=three.min.js)
gzip -dc "$library/three.min.js.gz" | cmp - "$tools/three.min.js"
echo "three.min.js.gz is what three/README.md makes"

NODE_PATH=$tools/node_modules node "$here/check.mjs" "$@"
