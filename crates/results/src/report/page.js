// What every report does: its data, the switch between light and dark, steps to choose from, packed pictures, and copying.
"use strict";
const elastocap = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);

  /** The bytes that gzip has compressed into a text in base64. */
  async function unpack(text) {
    if (typeof DecompressionStream === "undefined") throw new Error("this browser cannot unpack data");
    const bytes = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // The theme: that of the system, unless the reader has chosen.
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  const button = document.getElementById("theme");
  const listeners = [];
  function themed() {
    button.textContent = isDark() ? "Light" : "Dark";
    button.setAttribute("aria-label", `Switch to ${isDark() ? "light" : "dark"} colours`);
    listeners.forEach((listener) => listener());
  }
  button.hidden = false;
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    try {
      localStorage.setItem("elastocap-theme", root.dataset.theme);
    } catch {
      // Where nothing may be stored, the choice lasts as long as the page.
    }
    themed();
  });
  system.addEventListener("change", themed);
  themed();

  // Of several steps the chosen one is shown; on paper, all of them.
  for (const select of document.querySelectorAll("select[data-steps]")) {
    const steps = [...document.getElementById(select.dataset.steps).children];
    const show = () => steps.forEach((step) => step.classList.toggle("other", step.dataset.step !== select.value));
    select.closest(".chooser").hidden = false;
    select.addEventListener("change", show);
    show();
  }

  for (const place of document.querySelectorAll(".packed[data-svg]")) {
    unpack(place.dataset.svg).then(
      (bytes) => (place.outerHTML = new TextDecoder().decode(bytes)),
      () => {}, // Its text says where the picture is.
    );
  }

  for (const copy of document.querySelectorAll("button.copy")) {
    copy.addEventListener("click", async () => {
      const source = document.getElementById(copy.dataset.copy);
      try {
        await navigator.clipboard.writeText(source.textContent);
        copy.textContent = "Copied";
      } catch {
        getSelection().selectAllChildren(source);
        copy.textContent = "Selected";
      }
      setTimeout(() => (copy.textContent = "Copy"), 2000);
    });
  }

  // In the contents, the section that is being read is marked.
  const links = new Map([...document.querySelectorAll("nav a")].map((a) => [a.hash.slice(1), a]));
  const linkTo = (target) => links.get(target.localName === "h1" ? "main" : target.id);
  const observer = new IntersectionObserver(
    (entries) => {
      for (const entry of entries.filter((e) => e.isIntersecting)) {
        links.forEach((a) => a.removeAttribute("aria-current"));
        linkTo(entry.target)?.setAttribute("aria-current", "true");
      }
    },
    { rootMargin: "-4% 0px -75% 0px" },
  );
  document.querySelectorAll("main > section, h1").forEach((section) => observer.observe(section));

  return { data, unpack, isDark, onTheme: (listener) => listeners.push(listener) };
})();
