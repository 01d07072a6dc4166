#!/usr/bin/env bash
# Makes kendama_cli/report/replay/three.min.js from the versions that package-lock.json pins; the same bytes each time.
# Needs node and npm, and the network once; reports need neither.
set -euo pipefail
cd "$(dirname "$0")"
out=..

npm ci --silent
cp node_modules/three/LICENSE "$out/three.LICENSE"
{
  printf '/*! three.js %s\n' "$(node -p "require('./node_modules/three/package.json').version")"
  sed 's/^$/ /' "$out/three.LICENSE"
  printf '*/\n'
  npx --no-install esbuild entry.js --bundle --minify --format=iife --global-name=THREE --charset=ascii --target=es2022
} > "$out/three.min.js"
rm -rf node_modules
wc -c "$out/three.min.js"
