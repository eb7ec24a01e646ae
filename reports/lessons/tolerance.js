for (const film of document.querySelectorAll(".film")) {
  const knobs = [...film.querySelectorAll("[data-knob]")];
  const chosen = (knob) => knob.type === "range" ? knob.value : knob.querySelector("input:checked").value;
  const show = () => {
    for (const knob of knobs) if (knob.type === "range") {
      const text = JSON.parse(knob.dataset.texts)[knob.value];
      knob.setAttribute("aria-valuetext", text);
      knob.parentElement.querySelector("output").textContent = text;
    }
    const frame = film.querySelector(`template[data-frame="${knobs.map(chosen).join("-")}"]`).content.cloneNode(true);
    for (const part of ["says", "drawing"]) film.querySelector("." + part).replaceChildren(...frame.querySelector("." + part).childNodes);
  };
  film.querySelector(".knobs").hidden = false;
  film.addEventListener("input", show);
  show();
}
