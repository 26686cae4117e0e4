# Which container engine: $engine, and ${compose[@]} with it.
if command -v podman-compose > /dev/null; then
  engine=podman compose=(podman-compose)
elif command -v docker > /dev/null && docker compose version > /dev/null 2>&1; then
  engine=docker compose=(docker compose)
else
  echo "neither podman-compose nor docker compose is installed: apt-get install podman podman-compose" >&2
  exit 3
fi
