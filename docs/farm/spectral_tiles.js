// SPDX-License-Identifier: GPL-3.0-or-later
// Flamenco 3 job type: the frames of a scene over many machines, and, with more than one layer, the samples of each
// frame too, merged exactly afterwards.  Put this file into the folder `scripts` beside flamenco-manager.

const JOB_TYPE = {
    label: "Spectral Tiles",
    description: "Render by Cycles with Spectral Tiles, which the workers' Blender must have enabled.",
    settings: [
        { key: "blendfile", type: "string", required: true, visible: "web", description: "The .blend file" },
        {
            key: "frames", type: "string", required: true,
            eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
            description: "Frames to render, such as 1-10 or 1,4,8-12",
        },
        { key: "chunk_size", type: "int32", default: 1, description: "Frames of one task; with layers it is 1" },
        {
            key: "render_output", type: "string", subtype: "file_path", required: true,
            description: "Where the frames go, with a # for each digit of their numbers and an ending: /shared/shot/####.exr",
        },
        {
            key: "samples", type: "int32", required: true,
            eval: "C.scene.cycles.samples",
            description: "Samples a pixel; the most of them where the file has a noise threshold",
        },
        {
            key: "layers", type: "int32", default: 1,
            description: "Parts that a frame's samples are split into, each a task; more than one needs .exr",
        },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    if (settings.layers <= 1) {
        for (const frames of frameChunker(settings.frames, settings.chunk_size)) {
            job.addTask(renderTask(`render-${frames}`, settings, frames, settings.render_output, []));
        }
        return;
    }
    for (const frame of frameChunker(settings.frames, 1)) {
        const picture = settings.render_output.replace(/#+/, (digits) => frame.padStart(digits.length, "0"));
        const merge = author.Task(`merge-${frame}`, "blender");
        merge.addCommand(spectralTiles(["merge", picture]));
        for (let layer = 1; layer <= settings.layers; layer++) {
            const part = ["--layer", `${layer}/${settings.layers}`];
            const task = renderTask(`render-${frame}-layer-${layer}`, settings, frame, picture, part);
            merge.addDependency(task);
            job.addTask(task);
        }
        job.addTask(merge);
    }
}

function renderTask(name, settings, frames, output, more) {
    const task = author.Task(name, "blender");
    const samples = ["--samples", `${settings.samples}`];
    const what = ["render", settings.blendfile, "--frames", frames, "--output", output];
    task.addCommand(spectralTiles(what.concat(samples, more)));
    return task;
}

function spectralTiles(args) {
    return author.Command("exec", { exe: "{blender}", args: ["--command", "spectral_tiles"].concat(args) });
}
