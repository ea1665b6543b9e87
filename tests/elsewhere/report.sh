#!/bin/bash
# A fit's report in a browser: its parts are there, its pictures are decoded, and it asks for nothing
# else. Exits with 77 where there is no Chromium. Usage: report.sh QJULIA MESH FOLDER
set -euo pipefail
qjulia=$1 mesh=$2 folder=$3

chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) || {
  echo "SKIPPED: no chromium here; 'tools/install-dependencies --all' adds it (about 300 MB)"
  exit 77
}
rm -rf "$folder"
mkdir -p "$folder"
"$qjulia" fit "$mesh" -o "$folder/ball.qjulia.json" --factors 24 --max-evaluations 30 --device cpu \
  --report "$folder/report" --quiet

# The same page with a line that counts what the browser could decode and what it loaded.
count='<script>addEventListener("load", () => {
  const ready = [...document.images].filter((i) => i.complete \&\& i.naturalWidth > 0);
  const loaded = performance.getEntriesByType("resource").filter((e) => !e.name.startsWith("data:"));
  document.title = `images ${ready.length} of ${document.images.length}, loaded ${loaded.length}`;
});</script>'
page=$folder/counted.html
sed "s|</body>|${count//$'\n'/ }</body>|" "$folder/report/report.html" >"$page"
timeout 60 "$chromium" --headless --no-sandbox --disable-gpu --user-data-dir="$folder/profile" \
  --host-resolver-rules='MAP * ~NOTFOUND' --virtual-time-budget=5000 --dump-dom "file://$page" \
  >"$folder/dom.html" 2>"$folder/chromium.log" || { cat "$folder/chromium.log"; exit 1; }

failed=0
expect() {
  grep -qF -- "$1" "$folder/dom.html" || { echo "the page lacks: $1"; failed=1; }
}
expect '<title>images 7 of 7, loaded 0</title>' # three pictures and four curves
for part in '<h2>Pictures</h2>' 'the mesh' 'the potential, n = 1' 'the set, n = 6' \
  '<h2>How well it fits</h2>' 'Hausdorff' '<h2>How it went</h2>' 'energy before' \
  '<h2>How it was made</h2>' 'max_evaluations'; do
  expect "$part"
done
grep -o '<title>[^<]*' "$folder/dom.html" || true
exit $failed
