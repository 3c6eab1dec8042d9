() => {
    /** Compare each frame of which only a part was drawn anew with the whole frame. */
    const { drawing, drawing: { gpu, gpu: { gl }, canvas } } = studio.workbench;
    const { draw } = Object.getPrototypeOf(drawing);
    drawing.pixels = () => {
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        return new Uint32Array(gpu.read(0, 0, canvas.width, canvas.height).buffer);
    };
    drawing.draw = (samples) => {
        draw.call(drawing, samples);
        if (samples > 1) return;  // `pixelAt` draws for each pixel
        drawing.part = [...gl.getParameter(gl.SCISSOR_BOX)];
        if (drawing.part[2] === canvas.width && drawing.part[3] === canvas.height) return;
        const drawn = drawing.pixels();
        drawing.changed = null;
        draw.call(drawing, samples);
        if (drawing.pixels().some((color, i) => color !== drawn[i])) throw new Error("part");
    };
    window.tests = {
        /** Region, x and y of places in a grid that show a region. */
        places() {
            const { clientWidth, clientHeight } = document.querySelector("#canvas");
            const { cells, width, height, scale } = studio.workbench.picker.cellsSeen();
            const [rows, found] = [(y) => height - 1 - Math.floor(y * scale), []];
            for (let y = 4; y < clientHeight - 60; y += 8)
                for (let x = 4; x < clientWidth; x += 8) {
                    const cell = cells[rows(y) * width + Math.floor(x * scale)] | 0;
                    found.push([studio.workbench.regionOf(cell), x, y]);
                }
            return found.filter(([region]) => region >= 0);
        },
        /** Undo all work, and reset the view. */
        async beginAnew() {
            const { workbench } = studio;
            document.activeElement.blur();
            while (workbench.session.state.can_undo) await workbench.session.undo();
            workbench.hover(-1);
            workbench.clearSelection();
            workbench.showAll();
            delete workbench.drawing.camera.posesAround;
            workbench.drawing.camera.home();
            workbench.choose(1, 1);
        },
    };
}
