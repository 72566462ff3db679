// Shows one part of the report at a time, and builds a part when it is first shown.
const built = new Map();
const sections = [...document.querySelectorAll("section.subject")];

const open = (key) => { location.hash = key; };

const build = (section) => {
  const data = JSON.parse(document.getElementById(`${section.id}-data`).textContent);
  if (data.kind === "run") {
    if (!data.frames) return null;
    const player = new Player(section, data.frames);
    const root = section.querySelector(".histories");
    return { player, histories: root && new Histories(root, player, data.frames.histories) };
  }
  if (data.kind === "study") return null;
  const table = new CaseTable(section, data, open);
  return { table, map: data.pictures.length ? new Pictures(section, data, table, open) : null };
};

const show = () => {
  const wanted = sections.find((section) => `#${section.id}` === location.hash) ?? sections[0];
  for (const section of sections) {
    section.hidden = section !== wanted;
    if (section !== wanted) built.get(section.id)?.player?.pause();
  }
  for (const link of document.querySelectorAll("nav a")) {
    if (link.getAttribute("href") === `#${wanted.id}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  if (!built.has(wanted.id)) built.set(wanted.id, build(wanted));
  return wanted;
};

addEventListener("hashchange", () => {
  const section = show();
  scrollTo(0, 0);
  section.querySelector("h2").focus({ preventScroll: true });
});

// Keys work before anything has the focus, and after a click beside the part that is shown.
addEventListener("keydown", (event) => {
  if (event.target.closest("section")) return;
  built.get(sections.find((section) => !section.hidden).id)?.player?.key(event);
});

// A box whose table or picture is wider than the page says so: on phones nothing else shows that it scrolls.
const boxes = new ResizeObserver((entries) => {
  for (const { target } of entries) {
    const box = target.closest(".wide");
    box.classList.toggle("cut", box.scrollWidth > box.clientWidth + 1);
  }
});
for (const node of document.querySelectorAll(".wide, .wide > *")) boxes.observe(node);

// On paper nothing can be opened.
const opened = new Set();
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details:not([open]):not(.keys)")) {
    details.open = true;
    opened.add(details);
  }
});
addEventListener("afterprint", () => {
  for (const details of opened) details.open = false;
  opened.clear();
});

show();
window.blocksim = { built, decode };
