; The best program that evolution found for the building FMRB, as published: Figure 3 of M. C. Martin, "Evolving
; Visual Sonar: Depth From Monocular Images", 2006. Wherever the figure says  if A > B then S,  this says
; (if-le A B  else  S): where no statement runs stands 0, which has no effect.

(individual

  ; First tree: how the bottom of the image differs from floor. With h = moravec-horizontal,
  ;
  ;   b := (b (1 + h) - (1 + h + h^2 + h^4) x-obstacle) / h^5
  ;
  ; at every position, b being 3.40282e38 before the first. Register c holds h. Where h is 0, so is the divisor,
  ; and protected division makes b 1. Where it is not, it is at least 1/9, so in binary32 the first b (1 + h)
  ; overflows: b is infinite until a position without any texture resets it. No NaN comes up, for what is
  ; subtracted is finite and h^5, at least 1.6e-5, is not zero.
  (iterate-up 3x3 x-obstacle
    (prog3
      (set-c moravec-horizontal)
      (if-le first-window 0
        0
        (set-b 3.40282e38))
      (set-b
        (%
          (-
            (* read-b (+ 1 read-c))
            (* (+ (+ (+ 1 read-c) (square read-c)) (square (square read-c))) x-obstacle))
          (* (square (square read-c)) read-c)))))

  ; Second tree: a decision tree. Statements follow one another, none ends the iteration, and the iteration goes
  ; down, so a ends as the lowest row at which any of them fires.
  (iterate-down 3x3 x-obstacle
    (prog3
      ; if y <= 9 then a := y
      (if-le y 9 (set-a y) 0)
      ; if iter2-b > 9 then a := y
      (if-le iter2-b 9 0 (set-a y))
      ; if median > 35.4444 then: below that, gradients are made by the digitizer
      (if-le median 35.4444
        0
        (prog2
          ; if gradient > 413.96 then a := y
          (if-le gradient 413.96 0 (set-a y))
          ; if gradient > 239 and (gradient / 239)^4 > moravec-slash then a := y
          (if-le gradient 239
            0
            (if-le (square (square (% gradient 239))) moravec-slash
              0
              (set-a y))))))))
